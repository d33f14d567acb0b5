"""The command ``animate``: a result as a moving picture, GIF, or MP4 where ffmpeg is."""

from pathlib import Path

from mpmbench.commands.places import result_files
from mpmbench.commands.show import add_common, left_out, place, view_of, with_field
from mpmbench.commands.words import Words
from mpmbench.report.fields import NoField, field_of
from mpmbench.report.names import safe_name
from mpmbench.report.picture import encoder, film, gif, mp4
from mpmbench.results.netcdf import Damaged, load
from mpmbench.results.one_move import in_one_move
from mpmbench.runs.sweep.display import shorten
from mpmbench.say import say
from mpmbench.settings.schema import BadInput

FEW = 5  # instants that make no film


def parser() -> Words:
    """What can stand after ``animate``."""
    words = Words(
        "animate",
        "Draw all instants of a result, or of each in a folder, as a moving picture. "
        "A run keeps its instants with snapshots=40, snapshot_every=0.05 or snapshot_times=[...].",
        "results/default plastic_strain --mp4",
    )
    add_common(words)
    words.add_argument(
        "--mp4", action="store_true", help="MP4 instead of GIF; needs the program ffmpeg"
    )
    words.add_argument(
        "--seconds", type=float, default=4.0, help="that the film lasts; 4 by default"
    )
    return words


def main(arguments: list[str]) -> int:
    """``animate RESULT [FIELD]``; exit code 1 when some result has no particles."""
    given = with_field(parser().read(arguments))
    if not 0.0 < given.seconds <= 3600.0:
        raise BadInput(f"--seconds={given.seconds:g}: a number above 0, at most 3600, is needed")
    suffix = "mp4" if given.mp4 or (given.out and given.out.suffix.lower() == ".mp4") else "gif"
    if suffix == "mp4" and encoder() is None:
        raise BadInput(
            "--mp4: the program ffmpeg is not here; install it, or make a GIF without --mp4"
        )
    files = result_files("animate", Path(given.result))
    code = 0
    for file in files:
        try:
            dataset = load(file)
            name = field_of(dataset, given.field).name
            pictures = film(dataset, name, view_of(given, dataset))
        except (NoField, Damaged) as why:
            code = left_out("animate", file, why, alone=len(files) == 1)
            continue
        target = place(given.out, file, safe_name(name), suffix, files)
        with in_one_move(target) as unfinished:
            if suffix == "mp4":
                mp4(pictures, given.seconds, unfinished)
            else:
                unfinished.write_bytes(gif(pictures, given.seconds))
        say(shorten(str(target)))
        if len(pictures) < FEW:
            say(f"  it has {len(pictures)} instants: run it with snapshots=40 for a smooth one")
    return code
