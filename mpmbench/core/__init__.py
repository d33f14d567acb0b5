"""The solver: plain arrays in, plain arrays out. Knows nothing of configuration files, result files or the command line."""
