"""What is printed: text from files and plug-ins cannot steer a terminal, nor pass for another line."""

import sys
import textwrap

WIDEST = 80  # columns of what is printed by default
BELOW = " " * 8  # before a line that goes on with the one above


def visible(text: str) -> str:
    r"""`text` with the codes of what cannot be seen: control characters, changes of direction.

    >>> visible("a\x1b[2Jb")
    'a\\x1b[2Jb'
    """
    if text.isprintable():
        return text
    signs = (one if one.isprintable() else one.encode("unicode_escape").decode() for one in text)
    return "".join(signs)


def one_line(text: str) -> str:
    """`text` as it is printed within a line: blanks and line breaks are one blank each."""
    return visible(" ".join(text.split()))


def in_lines(text: str, below: str = "", first: str = "") -> list[str]:
    """`text` in lines of 80 columns, words whole; `first` and `below` stand before the first and the others.

    >>> in_lines("short", first="  ")
    ['  short']
    """
    around = {"initial_indent": first, "subsequent_indent": below}
    return textwrap.wrap(
        text,
        WIDEST,
        break_long_words=False,
        break_on_hyphens=False,
        **around,  # type: ignore[arg-type]
    )


def with_reason(start: str, text: str) -> list[str]:
    """A line with what is said of it: beside it where there is room, else below it.

    >>> with_reason("a", "b")
    ['a  b']
    """
    text = one_line(text)
    if len(start) + 2 + len(text) <= WIDEST:
        return [f"{start}  {text}".rstrip()]
    return [start.rstrip(), *in_lines(text, BELOW, BELOW)]


def say(*lines: object, error: bool = False) -> None:
    """Print lines, on standard error if `error`; a line break within one is shown as its code.

    Everything that the program says goes through here.
    """
    text = "\n".join(visible(str(line)) for line in lines)
    print(text, file=sys.stderr if error else sys.stdout, flush=True)
