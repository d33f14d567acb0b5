"""The side of a command: plan, run and follow many cases."""
