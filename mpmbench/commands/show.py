"""The command ``show``: a result as a picture, its particles coloured by a field."""

import argparse
import os
from pathlib import Path

import numpy as np
import xarray as xr

from mpmbench.commands.places import result_files
from mpmbench.commands.words import Words
from mpmbench.report.fields import NoField, field_of
from mpmbench.report.names import safe_name
from mpmbench.report.picture import View, picture, rendered, sheet
from mpmbench.results.netcdf import Damaged, load
from mpmbench.results.one_move import in_one_move
from mpmbench.runs.sweep.display import shorten
from mpmbench.runs.sweep.execute import check_folder
from mpmbench.say import BELOW, in_lines, say
from mpmbench.settings.schema import BadInput

FOLDER = "pictures"  # beside the results


def parser() -> Words:
    """What can stand after ``show``."""
    words = Words(
        "show",
        "Draw the particles of a result, or of each in a folder, coloured by a field, as PNG.",
        "results/default von_mises --time=0.5",
    )
    add_common(words)
    words.add_argument("--time", type=float, metavar="SECONDS", help="instant; the last by default")
    words.add_argument(
        "--sheet", action="store_true", help="one picture of all results of a folder, besides"
    )
    words.add_argument(
        "--window", action="store_true", help="open a window too, where there is a screen"
    )
    return words


def add_common(words: Words) -> None:
    """Add what pictures and films have in common."""
    add = words.add_argument
    add("result", metavar="RESULT", help="a result file, or a folder of them")
    add(
        "field",
        metavar="FIELD",
        nargs="?",
        help="von_mises, stress_12, velocity, velocity_error, ...",
    )
    add("--field", metavar="FIELD", dest="named", help="the same as FIELD")
    add(
        "--out",
        metavar="FILE",
        type=Path,
        help=f"where it goes; the folder {FOLDER} beside the result by default",
    )
    add("--no-exact", action="store_true", help="without the exact solution beside it")
    add("--nodes", action="store_true", help="with the nodes, where they stay in their places")
    add("--limits", metavar="LOW,HIGH", help="values at the ends of the colours")
    add("--view", metavar="AZIMUTH,ELEVATION", help="of the eye in 3D [degrees]; 45,20 by default")
    add(
        "--up",
        metavar="AXIS",
        type=int,
        choices=(1, 2, 3),
        default=3,
        help="axis that points upwards in 3D",
    )


def with_field(given: argparse.Namespace) -> argparse.Namespace:
    """The words, with the field wherever it was named; raises `BadInput` when it was named twice."""
    if given.named and given.field:
        raise BadInput(f"--field {given.named}: {given.field} is asked for already; name one field")
    given.field = given.field or given.named
    return given


def main(arguments: list[str]) -> int:
    """``show RESULT [FIELD]``; exit code 1 when some result has no particles."""
    given = with_field(parser().read(arguments))
    files = result_files("show", Path(given.result))
    windows, images, code = [], [], 0
    for file in files:
        try:
            dataset = load(file)
            k = instant(dataset, given.time)
            name = field_of(dataset, given.field).name
            figure = picture(dataset, name, k, view_of(given, dataset))
        except (NoField, Damaged) as why:
            code = left_out("show", file, why, alone=len(files) == 1)
            continue
        target = place(
            given.out, file, f"{safe_name(name)}{moment(dataset, given.time, k)}", "png", files
        )
        with in_one_move(target) as unfinished:
            images.append(rendered(figure))
            unfinished.write_bytes(images[-1])
        say(shorten(str(target)))
        windows.append(target)
    if given.sheet and images:
        target = place(given.out, files[0], "", "png", files).with_name("sheet.png")
        with in_one_move(target) as unfinished:
            unfinished.write_bytes(sheet(images))
        say(shorten(str(target)))
        windows = [target]
    if given.window:
        open_windows(windows)
    return code


def instant(dataset: xr.Dataset, time: float | None) -> int:
    """Number of the snapshot nearest to a time, by default the last; raises `BadInput` beyond the end."""
    times = dataset["snapshot_time"].values if "snapshot_time" in dataset else np.zeros(1)
    if time is None:
        return len(times) - 1
    if not 0.0 <= time <= times[-1] * (1.0 + 1e-9):
        raise BadInput(f"--time={time:g}: the result is from 0 to {times[-1]:g} s")
    return int(np.argmin(np.abs(times - time)))


def moment(dataset: xr.Dataset, time: float | None, k: int) -> str:
    """A part of a file's name for an instant that was asked for."""
    return "" if time is None else f"-{float(dataset['snapshot_time'].values[k]):.4g}s"


def view_of(given: argparse.Namespace, dataset: xr.Dataset) -> View:
    """How it is seen; raises `BadInput` for numbers that are none."""
    azimuth, elevation = pair("--view", given.view) or (45.0, 20.0)
    limits = pair("--limits", given.limits)
    if limits is not None and not limits[0] < limits[1]:
        raise BadInput(f"--limits={given.limits}: the second number must be the larger one")
    nodes = nodes_of(dataset) if given.nodes else None
    return View(nodes, not given.no_exact, limits, given.up - 1, azimuth, elevation)


def pair(option: str, text: str | None) -> tuple[float, float] | None:
    """Two numbers with a comma between them."""
    if text is None:
        return None
    try:
        first, second = map(float, text.split(","))
    except ValueError:
        raise BadInput(f"{option}={text}: two numbers are needed, as in {option}=0,10") from None
    if not np.isfinite([first, second]).all():
        raise BadInput(f"{option}={text}: two finite numbers are needed")
    return first, second


def nodes_of(dataset: xr.Dataset) -> np.ndarray:
    """The nodes of a run, shape (N, dim), from its settings; raises `NoField` where they move."""
    import json

    from mpmbench.case import read
    from mpmbench.core.errors import BadSetting, NotApplicable
    from mpmbench.results.bookkeeping import with_later

    try:
        case = read(with_later(json.loads(dataset.attrs["config"])))
    except (BadSetting, NotApplicable, KeyError) as error:
        raise BadInput(f"--nodes: its settings are none of this installation: {error}") from None
    if case.choices.moving:
        raise NoField("--nodes: the nodes of this method move, and a result does not hold them")
    return np.asarray(case.problem.nodes(case.resolution, case.choices).points)


def place(out: Path | None, file: Path, name: str, suffix: str, files: list[Path]) -> Path:
    """Where a picture goes; raises `BadInput` when nothing can be written there."""
    if out is None:
        target = file.absolute().parent / FOLDER / f"{file.stem}-{name}.{suffix}"
    elif len(files) > 1:
        target = out.absolute() / f"{file.stem}-{name}.{suffix}"
    else:
        target = out.absolute()
        if target.is_dir():
            target = target / f"{file.stem}-{name}.{suffix}"
        elif target.suffix.lower() != f".{suffix}":
            raise BadInput(f"--out={out}: a file ending in .{suffix} is needed")
    check_folder(target.parent, "--out:")
    return target


def left_out(command: str, file: Path, why: Exception, alone: bool) -> int:
    """Say that a result is left out, unless it is the only one: then it is bad input."""
    reason = why.reason if isinstance(why, Damaged) else str(why)
    if alone:
        raise BadInput(f"{command} {file}: {reason}")
    say(*in_lines(f"left out: {file.name}: {reason}", BELOW))
    return 1


def open_windows(pictures: list[Path]) -> None:
    """Show pictures in windows, where there is a screen; raises `BadInput` where there is none."""
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise BadInput("--window: there is no screen here; the picture is in its file")
    from PIL import Image

    for file in pictures:
        Image.open(file).show()
