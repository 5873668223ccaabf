"""Parameters of subdivision from observed parcels (Vanegas 2012, section 6)."""
