"""Nested settings as one level of dotted keys."""

from typing import Any


def dotted(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested dictionary as one with dotted keys, such as ``method.mass``."""
    flat: dict[str, Any] = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            flat |= dotted(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat
