"""What a result is: its file, its identity, where it comes from, and campaigns of them."""
