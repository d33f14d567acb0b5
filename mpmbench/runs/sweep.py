"""All cells of a sweep, before the first of them runs: what is wrong, what does not apply, what is finished already."""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mpmbench.runs import execute
from mpmbench.runs.identity import code_digests, code_hash, config_hash, result_path
from mpmbench.runs.provenance import attributes
from mpmbench.runs.schema import BadInput

# The same code would fail the same way again; whatever else failed may have been the machine's or the user's doing.
LASTING = ("ok", "diverged", "broke_down", "not_converged", "not_applicable")


@dataclass
class Cell:
    """One combination of a sweep."""

    overrides: list[str]
    config: dict[str, Any]
    not_applicable: str = ""
    earlier: dict[str, Any] | None = None  # attributes of the file of an earlier run
    state: str = "missing"  # missing, stale, failed, fresh: what its file is worth now

    @property
    def name(self) -> str:
        """Name of its file."""
        return result_path(self.config).stem


@dataclass
class Plan:
    """What a sweep will do."""

    to_run: list[Cell] = field(default_factory=list)
    finished: list[Cell] = field(default_factory=list)
    not_applicable: list[Cell] = field(default_factory=list)
    folder: str = ""

    def save(self, ledger: Path) -> None:
        """Leave it for the process that reports at the end."""
        failed = [
            execute.Record(path.stem, cell.earlier["status"], cell.earlier["reason"], str(path)).as_dict()
            for cell in self.finished
            if (path := result_path(cell.config)) and cell.earlier and cell.earlier["status"] not in execute.SUCCESS
        ]
        summary = {
            "to_run": len(self.to_run),
            "finished": len(self.finished),
            "not_applicable": [(cell.name, cell.not_applicable) for cell in self.not_applicable],
            "failed_before": failed,
            "folder": self.folder,
            "report": any(cell.config["report"] for cell in self.cells()),
        }
        (ledger / "plan.json").write_text(json.dumps(summary))

    def cells(self) -> list[Cell]:
        """All cells."""
        return [*self.to_run, *self.finished, *self.not_applicable]


def make_plan(combinations: list[list[str]], compose: Callable[[list[str]], tuple[dict[str, Any], str]]) -> Plan:
    """Compose and check every cell, and sort the cells by what is to be done with them.

    Parameters
    ----------
    combinations : list of list of str
        The overrides of each cell.
    compose : callable
        From overrides to the configuration and, when a key does not belong to a chosen option, the reason why the cell
        does not apply.

    Raises
    ------
    BadInput
        When any cell is wrong.
    """
    cells: dict[str, Cell] = {}
    for overrides in combinations:
        config, reason = compose(overrides)
        cells.setdefault(config_hash(config), Cell(overrides, config, reason))
    answers = execute.check([(cell.config, cell.not_applicable) for cell in cells.values()])
    plan = Plan()
    codes: dict[str, str] = {}
    for cell, answer in zip(cells.values(), answers, strict=True):
        cell.not_applicable, cell.earlier = answer["not_applicable"], answer["earlier"]
        if cell.not_applicable:
            plan.not_applicable.append(cell)
            continue
        chosen = "|".join(cell.config[group]["name"] for group in ("method", "basis", "material", "problem"))
        if chosen not in codes:
            codes[chosen] = code_hash(code_digests(cell.config))
        cell.state = state_of(cell.earlier, cell.config, codes[chosen])
        rerun = cell.config["rerun"]
        run_it = rerun == "all" or cell.state in ("missing", "stale") or (rerun == "failed" and cell.state == "failed")
        (plan.to_run if run_it else plan.finished).append(cell)
    if cells:
        plan.folder = str(result_path(next(iter(cells.values())).config).parent)
    return plan


def state_of(earlier: dict[str, Any] | None, config: dict[str, Any], code: str) -> str:
    """What the file of an earlier run is worth: missing, stale, failed or fresh.

    A run that was interrupted or crashed counts as missing, one that reached a limit as long as the limit was lower.
    """
    if earlier is None or earlier["config_hash"] != config_hash(config):
        return "missing"
    if earlier.get("code_hash") != code:
        return "stale"
    status = earlier["status"]
    if status == "timeout" or status == "out_of_memory":
        before = json.loads(earlier["config"])["limits"]
        raised = any((config["limits"][key] or 2**60) > (before[key] or 2**60) for key in before)
        return "missing" if raised else "failed"
    if status not in LASTING:
        return "missing"
    if config["timing"] == "exclusive" and earlier.get("timing_context") != "exclusive":
        return "stale"
    return "fresh" if status in execute.SUCCESS else "failed"


def record_inapplicable(plan: Plan) -> None:
    """Leave a file for each cell that does not apply, with the reason."""
    for cell in plan.not_applicable:
        earlier = cell.earlier or {}
        if earlier.get("status") == "not_applicable" and earlier.get("reason") == cell.not_applicable:
            continue
        verdict = {"status": "not_applicable", "reason": cell.not_applicable}
        execute.leave_record(cell.config, attributes(cell.config) | verdict)


def ledger() -> Path:
    """Folder in which every run leaves its record for the process that started the sweep."""
    return Path(os.environ["MPMBENCH_LEDGER"])


def note(record: execute.Record, number: int) -> None:
    """Leave the record of one run."""
    (ledger() / f"{number}.json").write_text(json.dumps(record.as_dict()))


def note_refusal(refusal: BadInput) -> None:
    """Leave what is wrong with a configuration."""
    (ledger() / "refused").write_text(json.dumps([str(refusal), refusal.exit_code]))


def raise_refusal() -> None:
    """Raise `BadInput` when a run has refused its configuration."""
    file = ledger() / "refused"
    if file.exists():
        raise BadInput(*json.loads(file.read_text()))


def records() -> list[execute.Record]:
    """Records of all runs so far."""
    files = sorted(ledger().glob("[0-9]*.json"), key=lambda file: int(file.stem))
    return [execute.Record(**json.loads(file.read_text())) for file in files]


def read_plan() -> dict[str, Any] | None:
    """The saved plan; None when none was made."""
    file = ledger() / "plan.json"
    return json.loads(file.read_text()) if file.exists() else None
