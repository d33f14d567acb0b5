"""Two pages from the stored runs of a matrix: all of it, and which method to take for what."""

from io import BytesIO
from pathlib import Path

from mpmbench.report import matrix, style
from mpmbench.report.front import Entry, Field, fields_of
from mpmbench.report.tables import Cell, Table, number_text
from mpmbench.report.writer import Writer
from mpmbench.results.records import Campaign

# What users ask, and the problems that answer it.
QUESTIONS = {
    "Small strain": ("plate_axis_aligned", "bar_fixed_ends", "plate_with_hole"),
    "Large strain without rotation": ("vertical_bar", "compaction_column"),
    "Large strain along no axis of the grid": ("radial_ring",),
    "Large rotation and shear": ("generalized_vortex", "zalesak_rotation", "cantilever_dynamic"),
    "History-dependent material": ("soil_column", "granular_collapse", "taylor_anvil"),
    "Contact": ("bouncing_disk", "elastic_rings", "colliding_disks", "friction_slope"),
}
# What the numbers of a problem are worth.
WORTH = {
    "granular_collapse": "The error is the distance from a law that was measured with 25 % of scatter: what "
    "lies within it is as good as any other, and the order of such methods says nothing.",
    "friction_slope": "The exact block is rigid: errors below its elastic shear, about 1e-5 m, say nothing.",
}
FIRST = 5  # combinations that a table of the best lists
COMMAND = "python -m mpmbench experiments=matrix && python -m mpmbench choose pages=reports"


def write(campaign: Campaign, target: Path) -> list[Path]:
    """Write ``matrix/README.md`` and ``which_method/README.md`` below `target` and return their places."""
    fields = fields_of(campaign)
    entries = {field.problem: field.entries() for field in fields}
    page, answers = Writer(target / "matrix"), Writer(target / "which_method")
    with style.applied():
        for name, figure in (
            ("heat_map", matrix.heat_map(entries)),
            ("profile", matrix.profile(entries)),
        ):
            drawing = BytesIO()
            figure.savefig(drawing, format="svg", metadata={"Date": None})
            page.data(f"figures/{name}.svg", drawing.getvalue())
    page.table(matrix.table(fields, entries))
    written = [
        page.text("README.md", matrix_page(campaign, fields, entries)),
        answers.text("README.md", which_method(fields, entries)),
    ]
    page.finish()
    answers.finish()
    return written


def matrix_page(
    campaign: Campaign, fields: list[Field], entries: dict[str, dict[str, Entry]]
) -> str:
    """The page of the whole matrix, in Markdown."""
    counts = campaign.runs.status.value_counts()
    ended = ", ".join(f"{n} {word.replace('_', ' ')}" for word, n in sorted(counts.items()))
    lines = [
        "# Everything against everything",
        f"{len(campaign.runs)} runs: {ended}. Made by `{COMMAND}`.",
        f"{matrix.CAPTION} Empty: the problem has no run of it.",
        "![Errors at equal cost](figures/heat_map.svg)",
        f"{matrix.PROFILE} The first ten.",
        "![Profile over the problems](figures/profile.svg)",
        "## Which is best on each problem",
        "\n".join(f"- `{field.problem}`: {field.sentence()}" for field in fields),
        "## Every cell",
        "[Errors, costs and reasons](tables/matrix.md) of all combinations.",
    ]
    return "\n\n".join(lines) + "\n"


def which_method(fields: list[Field], entries: dict[str, dict[str, Entry]]) -> str:
    """The answers to a user's question, in Markdown: what to take, at what cost, and what breaks."""
    lines = [
        "# Which method?",
        f"From the stored runs of `experiments=matrix`, by `{COMMAND}`. `python -m mpmbench choose "
        "problem=NAME error=NUMBER` gives the cheapest combination for an error, with its command. Costs "
        "are those of small sizes: methods of higher order gain with more cells.",
    ]
    for question, problems in QUESTIONS.items():
        lines.append(f"## {question}")
        there = [field for field in fields if base(field) in problems]
        if not there:
            lines.append("The stored runs have no problem of this kind.")
        for field in there:
            lines += [f"`{field.problem}`: {field.sentence()}", WORTH.get(base(field), "")]
            lines += [
                best(field, entries[field.problem]),
                broken(entries[field.problem]),
            ]
    asked = {name for names in QUESTIONS.values() for name in names}
    for field in fields:
        if base(field) not in asked:
            lines += [f"## {field.problem}", field.sentence(), broken(entries[field.problem])]
    return "\n\n".join(line for line in lines if line) + "\n"


def base(field: Field) -> str:
    """Name of the problem alone."""
    return field.problem.partition(",")[0]


def best(field: Field, entries: dict[str, Entry]) -> str:
    """The first combinations on a problem at equal cost, as a table in Markdown."""
    found = [(name, one) for name, one in entries.items() if one.error == one.error]
    found.sort(key=lambda pair: pair[1].error)
    rows = [[name, Cell(one.error), Cell(one.cost)] for name, one in found[:FIRST]]
    head = ["combination", f"error [{field.unit or '-'}]", "cost [s]"]
    listed = Table(f"best-{field.problem}", "", head, rows, "", (1, 2)).markdown()
    return f"The best within {number_text(field.cost)} s:\n\n{listed.strip()}"


def broken(entries: dict[str, Entry]) -> str:
    """What failed, and how."""
    ways: dict[str, list[str]] = {}
    for name, one in entries.items():
        if one.status not in ("ok", "not_applicable"):
            ways.setdefault(one.status.replace("_", " "), []).append(name)
    return "\n".join(f"- {way}: {'; '.join(names)}" for way, names in sorted(ways.items()))
