"""What is printed: text from files and plug-ins cannot steer a terminal, nor pass for another line."""

import sys


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


def say(*lines: object, error: bool = False) -> None:
    """Print lines, on standard error if `error`; a line break within one is shown as its code.

    Everything that the program says goes through here.
    """
    text = "\n".join(visible(str(line)) for line in lines)
    print(text, file=sys.stderr if error else sys.stdout, flush=True)
