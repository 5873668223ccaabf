"""The planar mesh that every layout is made of, its corners and its corner graph."""
