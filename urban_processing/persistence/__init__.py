"""What parcels and blocks were before an edit, and what they are after it (Vanegas 2012, 5)."""
