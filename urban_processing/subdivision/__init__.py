"""Strategies that cut parcels in two."""
