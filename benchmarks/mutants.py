"""Whether the tests notice changes of the program: ``python -m benchmarks mutants --seed 1 --count 100``.

Each mutant is one small change of one file in a copy of the sources. The tests that are nearest to
the file run first; what they let live may be run against the whole suite (``--whole``). Results go
to a file of JSON lines, and a mutant in it is not run again. Kernels that do not depend on the
changed file are taken from the cache of the unchanged sources.
"""

import argparse
import ast
import hashlib
import json
import os
import pickle
import resource
import shutil
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterable
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numba
import yaml
from numba.core.serialize import dumps

from .mutations import Mutant, draw

CHECKOUT = Path(__file__).parents[1]
LISTS = Path(__file__).with_suffix(".yaml")  # near tests, named mutants, those that change nothing
COPIED = ("mpmbench", "tests", "benchmarks", "conf", "experiments", "examples", "reports")
LIMIT = 300.0  # seconds of CPU time for the near tests of one mutant
WHOLE_LIMIT = 3600.0
HANGING = 10.0  # times its limit by the clock, and a run is taken to hang


def near_tests(near: dict[str, str], tree: Path, path: str) -> list[str]:
    """Test files of a tree for a file of the package, those that import it or bear its name first."""
    key = max((key for key in near if path.startswith(key)), key=len)
    files: list[Path] = []
    for name in near[key].split():
        place = tree / "tests" / name
        files += sorted(place.rglob("test_*.py")) if place.is_dir() else [place]
    own = tree / "tests" / Path(path).parent / f"test_{Path(path).stem}.py"
    module = f"mpmbench.{path[:-3].replace('/', '.')}".removesuffix(".__init__")
    if own.exists():
        files.append(own)
    ordered = sorted(
        dict.fromkeys(files), key=lambda file: (file != own, module not in imports(file))
    )
    return [str(file.relative_to(tree)) for file in ordered]


@cache
def imports(file: Path) -> set[str]:
    """Modules that a file imports, by their full names."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.update({node.module, *(f"{node.module}.{alias.name}" for alias in node.names)})
    return found


def dependents(path: str) -> list[Path]:
    """A file of the package and all files that import it, directly or not."""
    files = {
        ".".join(file.relative_to(CHECKOUT).with_suffix("").parts).removesuffix(".__init__"): file
        for room in ("mpmbench", "tests", "benchmarks")
        for file in (CHECKOUT / room).rglob("*.py")
    }
    imported = {name: imports(file) for name, file in files.items()}
    found = {f"mpmbench.{path[:-3].replace('/', '.')}".removesuffix(".__init__")}
    while more := {name for name, modules in imported.items() if modules & found} - found:
        found |= more
    return [files[name] for name in found]


def contents(tree: Path) -> dict[str, bytes]:
    """The files of the package, by their paths in it."""
    package = tree / "mpmbench"
    return {str(file.relative_to(package)): file.read_bytes() for file in package.rglob("*.py")}


def cpu_time_of_children() -> float:
    """Seconds that processes which were started here, and have ended, took."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Copy:
    """A copy of the sources with a cache of kernels, where files may be changed one at a time."""

    def __init__(self, scratch: Path) -> None:
        self.tree, self.cache = scratch / "tree", scratch / "cache"
        before = contents(self.tree)
        for name in COPIED:
            shutil.rmtree(self.tree / name, ignore_errors=True)
            skipped = shutil.ignore_patterns("__pycache__")
            shutil.copytree(CHECKOUT / name, self.tree / name, ignore=skipped)  # keeps times
        for file in CHECKOUT.glob("*.*"):
            if file.is_file():
                shutil.copy2(file, self.tree)
        self.environment = os.environ | {
            "PYTHONPATH": str(self.tree),
            "XDG_CACHE_HOME": str(self.cache),
            "PYTHONDONTWRITEBYTECODE": "1",  # a change within a second would not be seen
        }
        self.green, last = scratch / "green.txt", scratch / "kernels.txt"
        self.pristine = self.kernels()
        old = Path(last.read_text(encoding="utf-8")) if last.exists() else self.pristine
        if old != self.pristine and old.exists():  # keep what does not depend on what changed
            now = contents(self.tree)
            changed = [path for path, text in now.items() if before.get(path) != text]
            self.start_from(old, self.pristine, changed)
        last.write_text(str(self.pristine), encoding="utf-8")

    def start_from(self, old: Path, new: Path, changed: list[str]) -> None:
        """Fill a folder with the kernels of another one that do not depend on changed files."""
        shutil.rmtree(new, ignore_errors=True)
        shutil.copytree(old, new, copy_function=os.link)
        forget(new, [file for path in changed for file in dependents(path)])

    def kernels(self) -> Path:
        """Folder of the compiled kernels of the sources as they are."""
        code = "from mpmbench.runs.process.environment import cache_folder; print(cache_folder())"
        words = [sys.executable, "-c", code]
        said = subprocess.run(
            words, cwd=self.tree, env=self.environment, capture_output=True, text=True, check=True
        )
        return Path(said.stdout.strip())

    def run(self, tests: Iterable[str], limit: float, *options: str) -> tuple[str, str, float]:
        """Outcome, the first test that failed, and seconds of CPU time.

        The limit holds for CPU time, which does not depend on what else runs on the machine.
        """
        words = ["-m", "pytest", "-x", "-q", "-rfE", "-p", "no:cacheprovider", "-W", "ignore"]
        start = cpu_time_of_children()
        with subprocess.Popen(
            [sys.executable, *words, *options, *tests],
            cwd=self.tree,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        ) as process:
            allowed = max(1, int(limit))
            resource.prlimit(process.pid, resource.RLIMIT_CPU, (allowed, allowed))
            try:
                said = process.communicate(timeout=HANGING * limit)[0]
            except BaseException as error:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                if isinstance(error, subprocess.TimeoutExpired):
                    return "timeout", "", cpu_time_of_children() - start
                raise
        seconds = cpu_time_of_children() - start
        if process.returncode in (-signal.SIGKILL, -signal.SIGXCPU):
            return "timeout", "", seconds
        failed = [line for line in said.splitlines() if line.startswith(("FAILED", "ERROR"))]
        if process.returncode == 0:
            return "survived", "", seconds
        if process.returncode in (4, 5):
            raise RuntimeError(said)
        return "killed", failed[0].split(" - ")[0] if failed else said[-200:], seconds

    def run_each(self, tests: list[str]) -> tuple[str, str, float]:
        """As `run`, each file in a process of its own, as the unchanged sources were tested."""
        spent = 0.0
        for test in tests:
            outcome, by, seconds = self.run([test], LIMIT - spent, "-n", "0")
            spent += seconds
            if outcome != "survived":
                return outcome, by, spent
        return "survived", "", spent

    def green_ones(self, tests: list[str]) -> list[str]:
        """Those of the tests that succeed on the unchanged sources, which also compiles what they need."""
        lines = self.green.read_text(encoding="utf-8").splitlines() if self.green.exists() else []
        known = dict(line.split() for line in lines)
        good = []
        for test in tests:
            text = (self.tree / test).read_text(encoding="utf-8")
            key = hashlib.sha256(f"{self.pristine}{test}{text}".encode()).hexdigest()
            if key not in known:
                known[key], by, seconds = self.run([test], WHOLE_LIMIT, "-n", "0")
                print(f"unchanged: {known[key]} in {seconds:.0f} s: {by or test}", flush=True)
                with self.green.open("a", encoding="utf-8") as stream:
                    stream.write(f"{key} {known[key]}\n")
            if known[key] == "survived":
                good.append(test)
        return good

    def test(self, path: str, change: Callable[[str], str], tests: list[str], whole: bool) -> Any:
        """Run tests with one file changed."""
        file = self.tree / "mpmbench" / path
        source, times = file.read_text(encoding="utf-8"), file.stat()
        file.write_text(change(source), encoding="utf-8")
        folder = self.pristine
        try:
            folder = self.kernels()
            if folder != self.pristine:
                self.start_from(self.pristine, folder, [path])
            if whole:
                return self.run([], WHOLE_LIMIT)
            return self.run_each(tests)
        except subprocess.CalledProcessError as error:  # it does not even import
            return "killed", error.stderr.strip().splitlines()[-1][:200], 0.0
        finally:
            file.write_text(source, encoding="utf-8")
            os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
            if folder != self.pristine:
                shutil.rmtree(folder, ignore_errors=True)


def forget(folder: Path, changed: list[Path]) -> None:
    """Remove kernels of changed files, and those for handles and laws that these define.

    numba keeps an index per function, which tells the types of the arguments of each version.
    """
    classes = [
        node.name
        for file in changed
        for node in ast.walk(ast.parse(file.read_bytes()))
        if isinstance(node, ast.ClassDef)
    ]
    ours = {(file.parent.name, file.stem) for file in changed}
    for file in folder.glob("*/*.nbi"):
        if (file.parent.name.rpartition("_")[0], file.name.partition(".")[0]) in ours:
            file.unlink()
            continue
        with file.open("rb") as stream:
            version, rest = pickle.load(stream), stream.read()
        assert version == numba.__version__
        try:
            stamp, versions = pickle.loads(rest)
        except Exception:  # types of a module that is known to tests only
            file.unlink()
            continue
        kept = {
            key: data
            for key, data in versions.items()
            if not any(name in str(key[0]) for name in classes)
        }
        if len(kept) < len(versions):
            file.unlink()  # a link: the original stays
            with file.open("wb") as stream:
                pickle.dump(version, stream, protocol=-1)
                stream.write(dumps((stamp, kept)))


def named(lists: dict[str, Any]) -> list[Mutant]:
    """The mutants that the list gives by their text, which must stand once in the file."""
    found = []
    for entry in lists["named"]:
        path, before, after = entry["path"], entry["before"], entry["after"]
        source = (CHECKOUT / "mpmbench" / path).read_text(encoding="utf-8")
        if source.count(before) != 1:
            sys.exit(f"{path} has {before!r} {source.count(before)} times, where once is needed")
        start = source.index(before)
        line = source.count("\n", 0, start) + 1
        found.append(Mutant(path, start, before, after, "named", line, "", entry["says"]))
    return found


def table(records: list[dict[str, Any]], equivalent: dict[str, str]) -> str:
    """Counts by room, and the survivors."""
    rooms = sorted({record["path"].split("/")[0] for record in records})
    lines = [f"{'':10}{'killed':>8}{'timeout':>8}{'survived':>9}{'equivalent':>11}{'score':>7}"]
    for room in [*rooms, ""]:
        of_room = [r for r in records if r["path"].startswith(room)]
        count = Counter(
            "equivalent" if r["outcome"] == "survived" and r["name"] in equivalent else r["outcome"]
            for r in of_room
        )
        noticed = count["killed"] + count["timeout"]
        share = noticed / max(1, noticed + count["survived"])
        numbers = f"{count['survived']:9}{count['equivalent']:11}{share:7.0%}"
        lines.append(f"{room or 'all':10}{count['killed']:8}{count['timeout']:8}{numbers}")
    for record in records:
        if record["outcome"] == "survived" and record["name"] not in equivalent:
            lines.append(describe(record))
    return "\n".join(lines)


def describe(record: dict[str, Any]) -> str:
    """One line for one mutant."""
    change = f"{' '.join(record['before'].split())!r} -> {record['after']!r}"
    place = f"{record['path']}:{record['line']}"
    return f"{record['outcome']:9}{record['name']} {place} {change[:110]} | {record['text'][:90]}"


def arguments(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m benchmarks mutants", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--named", action="store_true", help="those of the list instead of a draw")
    parser.add_argument("--only", default="", help="part of the path, name or text of mutants")
    parser.add_argument("--again", action="store_true", help="run survivors once more")
    parser.add_argument("--whole", action="store_true", help="survivors against the whole suite")
    parser.add_argument("--show", action="store_true", help="only the table of what is there")
    parser.add_argument("--results", type=Path, default=LISTS.with_suffix(".jsonl"))
    parser.add_argument("--scratch", type=Path, required="--show" not in words, help="a folder")
    return parser.parse_args(words)


def main(words: list[str]) -> int:
    """Run what is not in the results, and print the table."""
    chosen = arguments(words)
    if not (CHECKOUT / "tests").is_dir():
        print("mutants: they are judged by the tests, which only a folder of the sources has")
        return 2
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the changed file is put back
    lists = yaml.safe_load(LISTS.read_text(encoding="utf-8"))
    equivalent = {entry["name"]: entry["reason"] for entry in lists["equivalent"]}
    drawn = draw(CHECKOUT / "mpmbench", chosen.seed)
    mutants = named(lists) if chosen.named else list(islice(drawn, chosen.count))
    mutants = [m for m in mutants if chosen.only in f"{m.path} {m.name} {m.text}"]
    known: dict[str, dict[str, Any]] = {}
    if chosen.results.exists():
        for line in chosen.results.read_text(encoding="utf-8").splitlines():
            record = json.loads(line)
            known[record["name"]] = record
    copy = None
    for mutant in [] if chosen.show else mutants:
        before = known.get(mutant.name)
        repeat = chosen.again or (chosen.whole and not (before or {}).get("whole"))
        alive = before and before["outcome"] == "survived" and mutant.name not in equivalent
        if before and not (alive and repeat):
            continue
        copy = copy or Copy(chosen.scratch.absolute())
        tests, whole = (
            near_tests(lists["near"], copy.tree, mutant.path),
            bool(before and chosen.whole),
        )
        if not whole:
            tests = copy.green_ones(tests)
        outcome, by, seconds = copy.test(mutant.path, mutant.apply, tests, whole)
        record = {key: value for key, value in vars(mutant).items() if key != "start"}
        record |= {"name": mutant.name, "outcome": outcome, "by": by, "whole": whole}
        record["seconds"] = round(seconds, 1)
        known[mutant.name] = record
        with chosen.results.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(record) + "\n")
        print(describe(record), f"| {by} | {seconds:.0f} s", flush=True)
    print(table([known[m.name] for m in mutants if m.name in known], equivalent))
    return 0
