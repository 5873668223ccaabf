"""Steering a layout level by level, on the map (Chen 2024, section 6: local control)."""
