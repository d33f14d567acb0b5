"""Pure functions of results: norms and orders of convergence."""
