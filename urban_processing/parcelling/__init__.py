"""Blocks to parcels, each block for itself (Vanegas 2012, section 4)."""
