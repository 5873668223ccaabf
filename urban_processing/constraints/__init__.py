"""What a planner gives besides the land: obstacles, locked land, streets, the rim, entries."""
