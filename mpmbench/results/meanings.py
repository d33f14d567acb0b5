"""What source files mean to a result, kept from one command to the next: to parse them takes 0.2 s.

It is kept by what the files hold, in the user's own folder of compiled kernels, and only for this
version of Python, which the digests depend on, and of this file.
"""

import ast
import hashlib
import json
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from mpmbench.results.one_move import in_one_move
from mpmbench.results.private import cache_home
from mpmbench.settings.files import BadInput

Meaning = tuple[str, tuple[str, ...]]  # digest, and the files of the package that are imported
FILE = "meanings.json"
MOST = 2000  # of the files of several versions
_fresh: dict[str, Meaning] = {}  # what has been parsed and is not kept yet


@cache
def meaning(file: Path, modified: int) -> Meaning:
    """Digest of a source file without comments and docstrings, and what it imports of ours."""
    content = file.read_bytes()
    name = hashlib.sha256(content).hexdigest()
    if name not in kept():
        _fresh[name] = kept()[name] = parsed(content)
    return kept()[name]


def keep() -> None:
    """Keep what has been parsed, where that is possible."""
    if not _fresh:
        return
    _fresh.clear()
    with suppress(OSError, BadInput):
        newest = dict(list(kept().items())[-MOST:])
        with in_one_move(cache_home() / FILE) as temporary:
            temporary.write_text(json.dumps({"by": parser(), "meanings": newest}))


@cache
def kept() -> dict[str, Meaning]:
    """What earlier commands have kept, by the digest of all that a file holds."""
    with suppress(OSError, BadInput, ValueError, KeyError, TypeError, AttributeError):
        found: dict[str, Any] = json.loads((cache_home() / FILE).read_text())
        if found["by"] == parser():
            return {
                name: (str(digest), tuple(imported))
                for name, (digest, imported) in found["meanings"].items()
            }
    return {}


def parser() -> str:
    """What a meaning depends on besides the file that has it."""
    return f"{sys.version} {hashlib.sha256(Path(__file__).read_bytes()).hexdigest()}"


def parsed(content: bytes) -> Meaning:
    """What a source file means."""
    tree = ast.parse(content)
    imported: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imported.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            imported.update({node.module, *(f"{node.module}.{alias.name}" for alias in node.names)})
        elif isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                node.body = node.body[1:] or [ast.Pass()]
    parts = [name.split(".")[1:] for name in imported if name.startswith("mpmbench.")]
    files = {f"{'/'.join(part)}{ending}" for part in parts for ending in (".py", "/__init__.py")}
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()[:16], tuple(sorted(files))
