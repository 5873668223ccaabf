"""The outside world: boundaries, CRSs, files, frames and places by name."""
