"""Functions of the nodes near a point: neighbour search, moving least squares, kernels of SPH."""
