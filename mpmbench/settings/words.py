"""What is printed about keys: defaults, units, sentences and ranges, in columns."""

import shutil
import textwrap
from typing import Any

from mpmbench.core.setting import Setting
from mpmbench.settings.schema import declared


def in_columns(sentences: dict[str, str]) -> list[str]:
    """Words and the sentences about them, below each other in the width of the terminal."""
    column = max(map(len, sentences), default=0) + 4
    width = max(60, shutil.get_terminal_size((120, 24)).columns)
    indent = " " * column
    return [
        line
        for word, said in sentences.items()
        for line in textwrap.wrap(f"  {word:<{column - 2}}{said}", width, subsequent_indent=indent)
    ]


def keys_of(group: str, option: str) -> list[str]:
    """The keys of an option with their defaults, and what is said about them."""
    keys = declared(group, option).items()
    return in_columns({f"{group}.{key}: {in_yaml(one.default)}": about(one) for key, one in keys})


def about(one: Setting) -> str:
    """Unit, sentence and what is allowed."""
    allowed = one.limits if one.options is None else " | ".join(map(str, one.options))
    parts = [f"[{one.unit}]" if one.unit else "", one.says, f"({allowed})" if allowed else ""]
    return " ".join(part for part in parts if part)


def in_yaml(value: Any) -> Any:
    """A value as YAML has it."""
    if value is None:
        return "null"
    return str(value).lower() if isinstance(value, bool) else value
