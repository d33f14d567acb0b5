"""One line for what a run raised: the error, its cause, and the place in the sources."""

import re
import traceback
from pathlib import Path

from mpmbench.core.registry import BrokenPlugin, plugin_files

LONGEST = 400  # characters of an error's text; the file keeps the whole traceback
# numba tells what it was doing from the outside in, and the cause last but for where it came up.
STEPS_OF_NUMBA = re.compile(r"Failed in \w+ mode pipeline \(step: [^)]*\)|raised a specific error:")
PLACE_OF_NUMBA = re.compile(r'\n\s*File "([^"]+)", line (\d+)')
AFTER_THE_CAUSE = re.compile(
    r"\n\s*(?:There are \d+ candidate|During:|raised from|File \"|Overload of function)"
)


def explain(error: BaseException) -> str:
    """One line: the error, and the place where it was raised, in a plug-in when one took part."""
    if isinstance(error, BrokenPlugin) and error.__cause__ is not None:
        return f"{text_of(error)}: {explain(error.__cause__)}"
    cause, place = cause_of(text_of(error))
    text = " ".join(cause.split())
    if len(text) > LONGEST:
        text = f"{text[: LONGEST // 2]} ... {text[-LONGEST // 2 :]}"
    place = place or place_of(error)
    kind = type(error).__name__
    return (text if text.startswith(f"{kind}:") else f"{kind}: {text}") + (place and f" ({place})")


def text_of(error: BaseException) -> str:
    """What an error says, without what a terminal or a file cannot take."""
    try:
        text = str(error)
    except BaseException as another:  # a plug-in's own class may do anything
        text = f"its text cannot be had: {type(another).__name__}"
    return "".join(one if one.isprintable() or one.isspace() else " " for one in text)


def cause_of(text: str) -> tuple[str, str]:
    """What an error says of its cause, and the place that it names; numba's errors bury both."""
    parts = STEPS_OF_NUMBA.split(text)
    if len(parts) == 1:
        return text, ""
    cause = AFTER_THE_CAUSE.split(parts[-1])[0]
    named = PLACE_OF_NUMBA.search(parts[-1])
    return cause, f"{Path(named[1]).name}, line {named[2]}" if named else ""


def place_of(error: BaseException) -> str:
    """File and line where an error was raised: the innermost of a plug-in, else of all."""
    if isinstance(error, SyntaxError):  # says it itself
        return ""
    frames = traceback.extract_tb(error.__traceback__)
    plugins = {str(file) for file in plugin_files()}
    chosen = [frame for frame in frames if frame.filename in plugins] or frames
    return f"{Path(chosen[-1].filename).name}, line {chosen[-1].lineno}" if chosen else ""
