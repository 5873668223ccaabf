"""Streets and parcels in the formats of programs for maps and traffic: OpenStreetMap, SUMO."""
