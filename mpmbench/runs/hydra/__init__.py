"""Our side of Hydra."""
