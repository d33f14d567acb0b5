"""Maximum-entropy functions on any set of nodes: priors, solver, locality, and two bases."""
