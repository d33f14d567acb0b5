"""The solver: plain arrays in, plain arrays out. Knows nothing of configuration, files or the command line."""
