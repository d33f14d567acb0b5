"""Configurations of runs and of the cells of sweeps, composed by Hydra."""

import itertools
import math
import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import hydra
from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override, RangeSweep
from hydra.core.plugins import Plugins
from hydra.errors import HydraException, OverrideParseException
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf.errors import OmegaConfBaseException

from mpmbench.runs.hydra.composer import Composer, Resolved
from mpmbench.runs.hydra.source import SCHEME, OptionsSource
from mpmbench.settings.arguments import value_of
from mpmbench.settings.files import read_yaml, shipped_folder
from mpmbench.settings.schema import GROUPS, BadInput, declared, experiments, options

DIGITS = 12  # of the values of a range
MOST_CELLS = 10**6  # of one sweep
# Launchers of which each needs an extra of this package.
EXTRAS = {"joblib": "joblib", "submitit_local": "slurm", "submitit_slurm": "slurm"}


class SearchPath(SearchPathPlugin):
    """Lets Hydra ask us for options and experiments before it looks for files."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        search_path.prepend("mpmbench", f"{SCHEME}://")


def wants_many(flags: Sequence[str], pairs: Sequence[str]) -> bool:
    """Whether the command line or the experiment asks for a sweep."""
    chosen = value_of("experiments", pairs)
    body = read_yaml(experiments()[chosen]).get("hydra", {}) if chosen in experiments() else {}
    asked = {"-m", "--multirun"} & set(flags) or "hydra.mode=MULTIRUN" in pairs
    return bool(asked) or body.get("mode") == "MULTIRUN"


def compose_many(combinations: Sequence[Sequence[str]]) -> list[Resolved]:
    """Configuration of each combination, and why it does not apply, if so; nothing runs.

    Raises `BadInput` when an override is wrong, or names a key that the chosen option lacks.
    """
    with composing([pair for pairs in combinations for pair in pairs]) as composer:
        return [composer.cell(pairs) for pairs in combinations]


def compose_sweep(pairs: Sequence[str]) -> list[Resolved]:
    """As `compose_many`, for a sweep; a cell with a key of another option does not apply."""
    with composing(pairs) as composer:
        return [composer.cell(cell, foreign_keys=True) for cell in expand(composer, pairs)]


def expand(composer: Composer, pairs: Sequence[str]) -> list[list[str]]:
    """Overrides of each cell, from the command line and an experiment's ``params`` and ``cases``.

    The command line beats a case, and a case beats ``params``.
    """
    of_hydra = words_of_hydra(pairs)
    master = composer.compose(of_hydra)
    params = [f"{key}={value}" for key, value in (master.hydra.sweeper.params or {}).items()]
    typed = [pair for pair in pairs if not pair.startswith(("hydra.", "hydra/"))]
    parser = OverridesParser.create(config_loader=GlobalHydra.instance().config_loader())
    values: dict[str, list[str]] = {}
    for override in parser.parse_overrides([*params, *typed]):
        key = override.get_key_element()
        if not override.is_sweep_override():
            values[key] = [f"{key}={override.get_value_element_as_str()}"]
        elif override.is_discrete_sweep():
            values[key] = [f"{key}={value}" for value in values_of(override)]
        else:
            raise BadInput(f"{override.input_line}: a list of values is needed, as in {key}=1,2")
    given = {pair.partition("=")[0] for pair in typed}
    cells = []
    for case in master.get("cases") or [""]:
        words = [word for word in str(case).split() if word.partition("=")[0] not in given]
        keys = {word.partition("=")[0] for word in words}
        kept = [texts for key, texts in values.items() if key not in keys]
        refuse_too_many(math.prod(map(len, kept)))
        cells.append([[*cell, *words] for cell in itertools.product(*kept)])
    return list(itertools.chain(*cells))


def values_of(override: Override) -> list[str]:
    """Values of one axis, those of a range rounded to `DIGITS` so that they are what one would type.

    Raises `BadInput` when there are none, or too many.
    """
    sweep = override.value()
    if isinstance(sweep, RangeSweep):
        numbers = itertools.islice(override.sweep_iterator(), MOST_CELLS + 1)
        found = [str(rounded(number)) for number in numbers]
        if found and found[-1] == str(rounded(sweep.stop)):  # it was not quite reached
            found.pop()
    else:
        found = list(override.sweep_string_iterator())
    if not found:
        raise BadInput(f"{override.input_line}: there is no value in this")
    refuse_too_many(len(found))
    return found


def rounded(number: Any) -> Any:
    """A number without the last digits of a float; whole numbers stay as they are."""
    return float(f"{number:.{DIGITS}g}") if isinstance(number, float) else number


def refuse_too_many(cells: int) -> None:
    """Raise `BadInput` for a sweep that nobody means."""
    if cells > MOST_CELLS:
        raise BadInput(f"-m: more than {MOST_CELLS} runs in one sweep; make several of it")


def words_of_hydra(pairs: Sequence[str]) -> list[str]:
    """Those overrides that Hydra needs to know the sweep: its own, and the experiment's name."""
    return [
        pair for pair in pairs if pair.lstrip("+~").startswith(("hydra.", "hydra/", "experiments="))
    ]


@contextmanager
def composing(pairs: Sequence[str]) -> Iterator[Composer]:
    """Something that composes; what Hydra says of the overrides becomes a sentence of `BadInput`."""
    if not __debug__:  # Hydra's parser has assertions that it needs
        raise BadInput("PYTHONOPTIMIZE, or python -O: settings cannot be read with it; unset it")
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra raises instead of printing
    GlobalHydra.instance().clear()
    Plugins.instance().register(OptionsSource)
    Plugins.instance().register(SearchPath)
    with (
        in_one_sentence(pairs),
        hydra.initialize_config_dir(str(shipped_folder("conf")), version_base="1.3"),
    ):
        yield Composer(lambda words: hydra.compose("config", words, return_hydra_config=True))


def show(flags: Sequence[str], pairs: Sequence[str]) -> None:
    """Let Hydra answer for itself: its configuration, its help, the completion of a shell."""
    before, sys.argv = sys.argv, ["mpmbench", *flags, *pairs]
    place = str(shipped_folder("conf"))
    try:
        with composing(pairs):
            GlobalHydra.instance().clear()
            main = hydra.main(version_base="1.3", config_path=place, config_name="config")
            main(lambda _: None)()
    finally:
        sys.argv = before


@contextmanager
def in_one_sentence(pairs: Sequence[str]) -> Iterator[None]:
    """Turn what Hydra raises into `BadInput`, unless it comes of an interruption."""
    try:
        yield
    except Exception as error:
        if comes_of_interruption(error):
            raise KeyboardInterrupt from None
        if isinstance(error, (HydraException, OmegaConfBaseException, ValueError)):
            raise readable(error, pairs) from None
        raise


def comes_of_interruption(error: BaseException | None) -> bool:
    """Whether an error came of what an interruption left half done."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def readable(error: Exception, pairs: Sequence[str]) -> BadInput:
    """One sentence for what Hydra has to say."""
    if isinstance(error, OverrideParseException):
        quote = "quote it if it holds special characters"
        return BadInput(f"{error.override}: this value is not understood; {quote}")
    text = " ".join(str(error).split() or str(error.__cause__ or type(error).__name__).split())
    for pair in pairs:
        key = pair.partition("=")[0]
        group, _, name = key.partition(".")
        if text.startswith(f"Could not override '{key}'") and group in GROUPS:
            owners = ", ".join(one for one in options(group) if name in declared(group, one))
            return BadInput(f"{pair}: the chosen {group} has no {name}, which belongs to {owners}")
        if "Ambiguous value" in text and f"'{pair}'" in text:
            return BadInput(f"{pair}: several values need -m, which runs each of them")
        if key == "hydra/launcher" and "Could not find" in text:
            extra = EXTRAS.get(pair.partition("=")[2])
            if extra is None:
                known = ", ".join(["basic", *EXTRAS])
                return BadInput(f"{pair}: there is no such launcher; there are {known}")
            install = f"install it by pip install 'mpmbench[{extra}]'"
            return BadInput(f"{pair}: this launcher is an extra; {install}")
    return BadInput(re.split(" To append to your config| Set the environment", text)[0])
