"""Functions on grids: products of functions along the axes."""
