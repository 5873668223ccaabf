"""Streets that reach every parcel, and the network that they form."""
