"""Halves of oriented boxes, many blocks at once (Vanegas 2012, section 4.3)."""
