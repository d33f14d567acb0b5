"""Mass matrices and their solvers."""
