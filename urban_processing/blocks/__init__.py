"""Blocks: what streets leave between them."""
