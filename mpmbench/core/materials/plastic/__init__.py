"""Plastic laws: one file each."""
