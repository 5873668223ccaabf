"""Global optimization of the geometry of parcels and streets (Chen 2024, section 5)."""
