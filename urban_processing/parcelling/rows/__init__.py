"""Rows of parcels on the straight skeleton of a block (Vanegas 2012, section 4.2)."""
