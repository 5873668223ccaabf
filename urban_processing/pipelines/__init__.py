"""The algorithms as short functions of named steps."""
