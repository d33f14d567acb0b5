"""Whatever stands on the command line: a plan, or exit code 2 and one sentence; never a traceback."""

from collections import Counter

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mpmbench.runs.hydra.compose import composing, in_one_sentence
from mpmbench.runs.hydra.composer import Composer
from mpmbench.runs.sweep import execute
from mpmbench.settings import arguments
from mpmbench.settings.schema import BadInput, all_keys

NUMBERS = st.one_of(
    st.integers(-3, 70).map(str),
    st.floats(allow_nan=True, allow_infinity=True).map(repr),
    st.sampled_from(
        ["1e-5", "0.5", "1e9", "-0", "0x10", "1_000", "1.", ".5", "1e-400", "auto", "null", "true"]
    ),
)
CHOICES = st.sampled_from(  # few, so that Hydra composes each of them once
    [
        [],
        ["method=otm"],
        ["method=mpm", "basis=bspline"],
        ["method=unified", "problem=plate_axis_aligned"],
        ["problem=plate_axis_aligned", "material=mohr_coulomb"],
        ["method=implicit_mpm"],
        ["experiments=quickstart"],
    ]
)
GOOD = st.sampled_from(
    [
        "resolution=8",
        "time_step=1e-6",
        "time_step=auto",
        "end_time=1e-4",
        "cfl=0.3",
        "particles_per_cell=4",
        "seed=3",
        "threads=1",
        "method.mass=lumped",
        "material.density=2",
        "campaign=mine",
        "limits.time=5",
        "on_error=stop",
        "snapshot_times=[1e-4,2e-4]",
        "rerun=failed",
        "timing=exclusive",
        "report=true",
        "resolution=16.0",
    ]
)
WORDS = st.text(st.characters(codec="utf-8", exclude_categories=("Cs",)), max_size=12)
ODD = st.sampled_from(
    [
        "",
        "a b",
        "\x00",
        *[
            "[",
            "[1,2]",
            "1,2",
            "{a:1}",
            "${x}",
            "${oc.env:HOME}",
            "'",
            '"',
            "\\",
            "choice(1,2)",
            "range(3)",
            "../x",
            "é",
            "~",
            "+1",
            "1;2",
            "$(ls)",
        ],
    ]
)
KEYS = st.one_of(
    st.sampled_from(all_keys()),
    st.sampled_from(["methd", "basis.dmax", "method.name", "hydra.job", "x"]),
)
WRONG = st.one_of(
    st.tuples(KEYS, st.one_of(NUMBERS, ODD, WORDS)).map("=".join),
    st.tuples(st.sampled_from(["+", "++", "~", ""]), KEYS, NUMBERS).map(
        lambda parts: f"{parts[0]}{parts[1]}={parts[2]}"
    ),
    WORDS,
)
LISTS = st.tuples(
    CHOICES,
    st.lists(GOOD, max_size=4),
    st.one_of(st.just([]), st.just([]), st.lists(WRONG, min_size=1, max_size=2)),
).map(lambda parts: [*parts[0], *parts[1], *parts[2]])


@pytest.fixture(scope="module")
def composer():
    """One composition by Hydra for each choice of options, for all examples together."""

    with composing([]) as made:
        yield made


def planned(composer: Composer, words: list[str]) -> str:
    """What becomes of a list of overrides: ``valid``, ``inapplicable`` or ``refused``."""
    try:
        flags, pairs = arguments.split(words, ["list"])
        if flags:
            return "flags"
        with in_one_sentence(pairs):
            config, reason = composer.cell(pairs)
        answer = execute.check([(config, reason)])[0]
    except BadInput as refusal:
        sentence = str(refusal)
        assert refusal.exit_code == 2
        assert 5 < len(sentence) < 1000
        assert "\n" not in sentence and "Traceback" not in sentence
        return "refused"
    return "inapplicable" if answer["not_applicable"] else "valid"


@pytest.mark.parametrize("number", [40, pytest.param(500, marks=pytest.mark.slow)])
def test_random_override_lists(composer, folder, number):
    counts: Counter[str] = Counter()

    @settings(
        max_examples=number, deadline=None, database=None, derandomize=True,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
    )  # fmt: skip
    @given(words=LISTS)
    def example(words):
        counts[planned(composer, words)] += 1

    example()
    total = sum(counts.values())
    assert total >= number
    assert counts["valid"] >= total / 5, counts
    assert counts["refused"] >= total / 10, counts
    assert list(folder.iterdir()) == []


@settings(max_examples=6, deadline=None, database=None, derandomize=True,
          suppress_health_check=[HealthCheck.function_scoped_fixture])  # fmt: skip
@given(words=LISTS)
def test_the_whole_command_line_says_the_same(command, words):
    if any(word.startswith("-") or word in ("list", "") for word in words):
        return
    outcome = command("status", "-m", *words)
    assert outcome.code in (0, 2)
    assert "Traceback" not in outcome.err
    assert outcome.err.count("\n") == (1 if outcome.code == 2 else 0)
