"""What layout files hold besides their tables, and how a layout comes back from them."""
