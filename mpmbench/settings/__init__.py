"""Which settings there are, and what a command line makes of them."""
