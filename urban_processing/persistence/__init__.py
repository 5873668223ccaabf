"""Parcels that stay themselves through edits (Vanegas 2012, section 5)."""
