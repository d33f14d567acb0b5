"""A table in LaTeX, by the Styler of pandas: for the packages booktabs and siunitx."""

import re
from collections.abc import Collection, Sequence

import pandas as pd

SPECIAL = {character: "\\" + character for character in "&%_#${}"} | {
    "\\": r"\textbackslash{}", "^": r"\^{}", "~": r"\textasciitilde{}", "<": "$<$", ">": "$>$",
    "±": r"$\pm$", "²": "$^2$", "³": "$^3$", "µ": r"$\mu$", "|": r"$|$", "*": "$*$",
}  # fmt: skip
NUMBER = re.compile(r"(-?)(\d+)(?:\.(\d*))?(?:e([+-]?)(\d+))?")
LONG = 45  # characters of a text that is set in lines
NEEDS = "% \\usepackage{booktabs, siunitx}\n"
NOTE = "\\par\\smallskip\n\\begin{minipage}{\\linewidth}\\footnotesize\n%s\n\\end{minipage}\n"


def latex(
    name: str,
    title: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[str]],
    numeric: Collection[int],
    note: str = "",
) -> str:
    """A floating table with caption, label and note; numbers stand on their decimal points.

    Parameters
    ----------
    name : str
        The label is ``tab:name``.
    rows : sequence of sequence of str
        As they are shown.
    numeric : collection of int
        Columns of numbers; words in them are set as such.
    """
    numeric = {k for k in numeric if any(NUMBER.fullmatch(row[k]) for row in rows)}
    cells = [
        [_number_or_words(text) if k in numeric else escaped(text) for k, text in enumerate(row)]
        for row in rows
    ]
    # Columns by their numbers: two may have the same name.
    frame = pd.DataFrame(cells, columns=range(len(columns)), dtype=object)
    style = frame.style.hide(axis="index").format_index(lambda k: escaped(columns[k]), axis=1)
    text: str = style.to_latex(
        column_format="".join(_column([row[k] for row in rows], k in numeric) for k in frame),
        hrules=True,
        siunitx=True,
        position_float="centering",
        caption=escaped(title) or None,
        label=f"tab:{name}",
    )
    if note:
        text = text.replace("\\end{table}", NOTE % escaped(note) + "\\end{table}")
    return NEEDS + text


def escaped(text: str) -> str:
    """Plain text; ``1.2e-05`` becomes a power of ten."""
    return re.sub(
        r"(?<![\w.])(\d+(?:\.\d+)?)e([+-]\d+)\b",
        lambda m: rf"${m[1]} \times 10^{{{int(m[2])}}}$",
        "".join(SPECIAL.get(character, character) for character in text),
    )


def _number_or_words(text: str) -> str:
    return text if NUMBER.fullmatch(text) else f"{{{escaped(text)}}}"


def _column(texts: list[str], numeric: bool) -> str:
    """The form of a column: room for the longest number, or text, in lines where it is long."""
    if not numeric:
        return "p{6cm}" if max(map(len, texts), default=0) > LONG else "l"
    found = [match.groups(default="") for match in map(NUMBER.fullmatch, texts) if match]
    sign, whole, places, exponent_sign, exponent = (
        max(part, key=len) for part in zip(*found, strict=True)
    )
    form = f"{sign}{len(whole)}.{len(places)}"
    form += f"e{'-' if exponent_sign else ''}{len(exponent.lstrip('0')) or 1}" if exponent else ""
    return f"S[table-format={form}]"
