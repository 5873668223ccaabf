"""Steering a layout level by level: candidates, choices, edits, undo (Chen 2024, section 6)."""
