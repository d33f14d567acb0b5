"""What is printed about keys: defaults, units, sentences and ranges, in columns."""

import shutil
import textwrap
from typing import Any

from mpmbench.core.setting import Setting
from mpmbench.settings.schema import declared

WIDEST = 36  # column of the sentences at most


def in_columns(sentences: dict[str, str]) -> list[str]:
    """Words and the sentences about them, below each other in the width of the terminal."""
    column = min(max(map(len, sentences), default=0) + 4, WIDEST)
    width = max(60, shutil.get_terminal_size((80, 24)).columns)
    indent = " " * column
    return [
        line
        for word, said in sentences.items()
        for line in lines_of(f"  {word:<{column - 2}}", said, width, indent)
    ]


def lines_of(word: str, said: str, width: int, indent: str) -> list[str]:
    """A word and what is said of it, below the word where that is too long to stand beside."""
    if len(word.rstrip()) > len(indent) - 2:
        below = {"initial_indent": indent, "subsequent_indent": indent}
        return [word.rstrip(), *textwrap.wrap(said, width, **below)]  # type: ignore[arg-type]
    return textwrap.wrap(word + said, width, subsequent_indent=indent) or [word.rstrip()]


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
