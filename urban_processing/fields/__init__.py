"""Cross fields of parcels and the streamlines traced along them."""
