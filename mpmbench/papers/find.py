"""Papers by name: ours, and those that a plug-in's folder brings in ``papers/``."""

import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from mpmbench.papers.kit import Paper
from mpmbench.settings.files import PACKAGE, papers
from mpmbench.settings.schema import BadInput


def names() -> list[str]:
    """Papers that have a report, sorted."""
    return list(papers())


def find(name: str) -> Paper:
    """The paper of that name.

    Raises
    ------
    KeyError
        When there is none.
    BadInput
        When its file cannot be imported, or its `Paper` has another name than the folder.
    """
    file = papers()[name]
    ours = file.is_relative_to(PACKAGE / "papers")
    module = importlib.import_module(f"mpmbench.papers.{name}") if ours else _load(file, name)
    paper: Paper = module.PAPER
    if paper.name != name:
        raise BadInput(f"{file}: the paper is called {paper.name}, but its file or folder {name}")
    return paper


def _load(file: Path, name: str) -> ModuleType:
    """Import a paper from outside; it reaches the modules beside it by ``from . import ...``."""
    module_name = f"mpmbench_paper_{name}"
    known = sys.modules.get(module_name)
    if known is not None and known.__file__ == str(file):
        return known
    folder = [str(file.parent)] if file.parent.name == name else None
    spec = importlib.util.spec_from_file_location(
        module_name, file, submodule_search_locations=folder
    )
    assert spec is not None and spec.loader is not None  # the file ends in .py
    module = sys.modules[module_name] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[module_name]
        raise BadInput(
            f"{file}: the paper cannot be imported: {type(error).__name__}: {error}"
        ) from error
    return module
