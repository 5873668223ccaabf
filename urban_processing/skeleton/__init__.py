"""The straight skeleton of polygons (Aichholzer et al. 1995)."""
