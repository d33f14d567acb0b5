"""What a result file says, made safe for a path, an identifier, a link or a figure.

Result files come from other machines. Whatever is read from one and names something goes through
here; text that is only shown is escaped by the page's templates.
"""

import hashlib
import re

LONGEST = 300  # characters of a label
SAFE = re.compile(r"[A-Za-z0-9_-]{1,80}")


def safe_name(text: str) -> str:
    """`text` where it is made of letters, digits, ``_`` and ``-``; else a hash of it.

    >>> safe_name("bar_fixed_ends")
    'bar_fixed_ends'
    """
    if SAFE.fullmatch(text):
        return text
    return "x" + hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]


def anchor(file: str) -> str:
    """Identifier of the run of a file on a page: each word of its name as by `safe_name`."""
    return "".join(part if part in "./" else safe_name(part) for part in re.split(r"([./])", file))


def drawn(text: str) -> str:
    """`text` for a figure: no formula begins at a dollar sign, nothing is invisible or endless, ``m^2`` is raised."""
    text = text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"
    visible = "".join(sign if sign.isprintable() or sign == "\n" else "\ufffd" for sign in text)
    return re.sub(r"(?<=[A-Za-z])\^(\d[\d.]*)", r"$^{\1}$", visible.replace("$", r"\$"))
