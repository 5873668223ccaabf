"""Urban fabric: land with its streets, blocks and parcels, wherever they come from."""
