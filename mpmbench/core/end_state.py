"""The state at the end of a run as plain numbers, from which a longer run goes on with the same bits.

One walk over everything that a simulation consists of finds its numbers: arrays of floats and of
truth values, and single numbers, whatever the method, the basis and the contact are. What is found
anew in every step is left out: neighbours, functions at the particles, memory of solvers, and whatever
has a name with an underscore in front. So places in memory never come from a file, and neither do
whole objects: the numbers are put into the objects of a simulation that has just been built from
the same settings.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field, is_dataclass
from math import prod
from typing import Any

import numpy as np

from mpmbench.core.bases.handle import Stencils
from mpmbench.core.errors import NotApplicable

# Attributes that every step finds anew, or that are the settings of a run.
LEFT_OUT = {
    *("room", "mass", "pattern", "pattern_of", "ghost", "ghost_grid", "memory"),
    *("choices", "material", "loads", "geometry", "initial_nodes", "body_masses"),
    *("pending", "next_sample", "end_time", "history", "records", "snapshots", "end_state"),
}
SUMS = {f"state/nodes/{name}" for name in ("q", "f", "f_internal", "f_external")}
SINGLE = (bool, int, float, type(None), np.generic)


@dataclass
class EndState:
    """What a run is continued from.

    Attributes
    ----------
    arrays : dict of ndarray
        Arrays of numbers by their place, for example ``state/particles/F``.
    single : dict
        Numbers, truth values and None, by their place.
    history, records : dict of list
        As in `mpmbench.core.simulation.Solution`.
    snapshots : list of dict
        Those between the start and the end.
    """

    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    single: dict[str, Any] = field(default_factory=dict)
    history: dict[str, list[Any]] = field(default_factory=dict)
    records: dict[str, list[Any]] = field(default_factory=dict)
    snapshots: list[dict[str, Any]] = field(default_factory=list)


def numbers_of(whole: Any) -> tuple[dict[str, np.ndarray], dict[str, tuple[Any, str]]]:
    """The arrays below an object, by their place, and the owner and name of each single number."""
    arrays: dict[str, np.ndarray] = {}
    single: dict[str, tuple[Any, str]] = {}
    known: set[int] = set()

    def visit(thing: Any, place: str) -> None:
        if id(thing) in known or isinstance(thing, (Stencils, *SINGLE)):
            return
        known.add(id(thing))
        if isinstance(thing, np.ndarray):
            if thing.dtype.kind in "fb" and thing.flags.writeable and place not in SUMS:
                arrays[place] = thing
            return
        own = owns(thing)
        for name, value in members(thing):
            if isinstance(value, SINGLE):
                if own:
                    single[f"{place}/{name}"] = thing, name
            else:
                visit(value, f"{place}/{name}")

    for name, value in members(whole):
        if isinstance(value, SINGLE):
            single[name] = whole, name
        else:
            visit(value, name)
    return arrays, single


def owns(thing: Any) -> bool:
    """Whether the single numbers of an object are its state, and not settings."""
    frozen = is_dataclass(thing) and thing.__dataclass_params__.frozen  # type: ignore[union-attr]
    return not frozen and not isinstance(thing, (dict, list, tuple))


def members(thing: Any) -> Iterator[tuple[str, Any]]:
    """Names and values of what an object of ours, a list or a dictionary holds, but for `LEFT_OUT`."""
    if isinstance(thing, dict):
        found = [(str(key), value) for key, value in thing.items()]
    elif isinstance(thing, (list, tuple)):
        found = [(str(number), value) for number, value in enumerate(thing)]
    elif not callable(thing) and hasattr(thing, "__dict__") and not is_foreign(thing):
        found = list(vars(thing).items())
    else:
        found = []
    for name, value in found:
        if name not in LEFT_OUT and not name.startswith("_"):
            yield name, value


def is_foreign(thing: Any) -> bool:
    """Whether an object belongs to a library, which keeps what can be found again."""
    return type(thing).__module__.partition(".")[0] in ("scipy", "numpy", "numba", "builtins")


def end_state(watch: Any) -> EndState:
    """What a run is continued from; the arrays are those of the simulation, not copies.

    Parameters
    ----------
    watch : mpmbench.core.simulation.Watch
        Of a run that has come to its end.
    """
    arrays, single = numbers_of(watch)
    values = {place: plain(getattr(owner, name)) for place, (owner, name) in single.items()}
    solution = watch.solution
    return EndState(arrays, values, solution.history, solution.records, solution.snapshots[1:-1])


def refuse_unlike(watch: Any, before: EndState) -> None:
    """Raise `NotApplicable` with the place unless an end state has the numbers that a new simulation has."""
    arrays, single = numbers_of(watch)
    for ours, theirs in ((arrays, before.arrays), (single, before.single)):
        for place in sorted(ours.keys() ^ theirs.keys()):
            where = "only at the end of the stored run" if place in theirs else "not stored"
            raise NotApplicable(f"its state is not kept whole: {place} is {where}")
    for place, array in arrays.items():
        shape = before.arrays[place].shape
        if shape != array.shape:
            raise NotApplicable(
                f"its state is not kept whole: {place} has the shape {shape} at the end of the "
                f"stored run, and {array.shape} at the start"
            )


def put_back(watch: Any, before: EndState) -> None:
    """Bring a simulation that has done its first step to the end of the stored run.

    That step has allocated what is allocated in it, and attached points to cells.

    Raises
    ------
    NotApplicable
        As `refuse_unlike` does.
    """
    refuse_unlike(watch, before)
    arrays, single = numbers_of(watch)
    for place, array in arrays.items():
        array[...] = before.arrays[place]
    for place, (owner, name) in single.items():
        setattr(owner, name, before.single[place])
    state, solution = watch.state, watch.solution
    solution.history.clear()
    solution.history |= {name: list(values) for name, values in before.history.items()}
    state.records.clear()
    state.records |= {name: list(values) for name, values in before.records.items()}
    solution.snapshots += before.snapshots
    if state.choices.moving and not state.choices.frozen:
        state.basis.move(np.zeros_like(state.basis.nodes))  # what belongs to these nodes


def as_numbers(before: EndState) -> tuple[np.ndarray, str]:
    """An end state as one row of numbers, and as JSON on what is where."""
    arrays = dict(before.arrays)
    for k, shot in enumerate(before.snapshots):
        arrays |= {f"snapshot/{k}/{name}": a for name, a in shot.items() if name != "time"}
    row = [tight(np.ravel(array).astype(float)) for array in arrays.values()]
    told = {
        "shapes": {place: list(array.shape) for place, array in arrays.items()},
        "sizes": [len(part) for part in row],
        "single": before.single,
        "history": before.history,
        "records": before.records,
        "times": [shot["time"] for shot in before.snapshots],
    }
    return np.concatenate(row), json.dumps(told, separators=(",", ":"), default=plain)


def tight(values: np.ndarray) -> np.ndarray:
    """The first of numbers that are the same in all bits, else all of them."""
    return values[:1] if (values.view(np.int64) == values[:1].view(np.int64)).all() else values


def plain(value: Any) -> Any:
    """Lists and numbers of Python instead of an array or a number of numpy."""
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def from_numbers(row: np.ndarray, text: str) -> EndState:
    """The end state of `as_numbers`; raises `NotApplicable` for what is none."""
    try:
        told = json.loads(text)
        parts = np.split(row, np.cumsum(told["sizes"])[:-1])
        arrays = {
            place: np.broadcast_to(part, prod(shape)).reshape(shape)
            for (place, shape), part in zip(told["shapes"].items(), parts, strict=True)
        }
        shots: list[dict[str, Any]] = [{"time": float(time)} for time in told["times"]]
        for place in [place for place in arrays if place.startswith("snapshot/")]:
            _, number, name = place.split("/")
            shots[int(number)][name] = arrays.pop(place)
        single = {
            place: value for place, value in told["single"].items() if isinstance(value, SINGLE)
        }
        return EndState(arrays, single, told["history"], told["records"], shots)
    except (KeyError, ValueError, TypeError, AttributeError, IndexError) as error:
        raise NotApplicable(f"its end state cannot be read: {error}") from None
