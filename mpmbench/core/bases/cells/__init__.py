"""Linear functions on cells and simplices."""
