"""The side of the child process that runs one case, and what guards it."""
