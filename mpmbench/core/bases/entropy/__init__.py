"""Maximum-entropy functions on any set of nodes: priors, the solver for the multipliers, locality, and two bases."""
