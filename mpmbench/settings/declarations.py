"""What each option can be set to, read from the text of the class that it registers; nothing is imported.

A class is the one declaration of its keys: ``key: type = setting(default, sentence, unit=..., ...)``
with literals, in itself or in a class that it derives from. What stands in a YAML file of the same
name changes defaults. Keys of plug-ins that declare nothing come from their plain defaults and YAML.
"""

import ast
import re
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mpmbench import PLACES
from mpmbench.core.moved import MOVED
from mpmbench.core.registry import PACKAGE, places, plugin_files, while_plugins_stay
from mpmbench.core.setting import Setting
from mpmbench.settings.files import BadInput

PUBLIC = {name: f"mpmbench.{place}" for name, place in PLACES.items()}
SEED = "random_seed"  # a field of problems that are random: they get the top-level key seed
REGISTERED = re.compile(
    r'^@register\("(\w+)", "(\w+)"\)\n(?:[@ )].*\n)*(?:class|def) (\w+)', re.MULTILINE
)
IMPORT = re.compile(r"^from ([\w.]+) import (\([^)]*\)|[^\n(]*)$", re.MULTILINE)
END = re.compile(r"^[^\s)\]#]", re.MULTILINE)  # of a class: the next line that is not indented
METHOD = re.compile(r"^    def .*\n(?:(?: {8}.*| {4}\).*)?\n)*", re.MULTILINE)


@dataclass
class Declaration:
    """A registered class as its text has it: its first sentence, and its settings by key."""

    sentence: str = ""
    settings: dict[str, Setting] = field(default_factory=dict)


@while_plugins_stay
def registered(kind: str) -> dict[str, Path]:
    """File of every option that registers itself as one of this kind, by name."""
    theirs = {name: file for file in plugin_files() for of, name in classes_in(file) if of == kind}
    ours = {name: file_of(module) for name, module in places(kind).items()}
    return theirs | {name: file for name, file in ours.items() if file is not None}


@cache
def text_of(file: Path) -> str:
    """Text of a source file; it is read once."""
    return file.read_text(encoding="utf-8-sig", errors="replace")


@cache
def classes_in(file: Path) -> dict[tuple[str, str], str]:
    """Names of the classes that a file registers, by kind and name of the option."""
    return {(kind, name): found for kind, name, found in REGISTERED.findall(text_of(file))}


def declaration(kind: str, name: str) -> Declaration:
    """What an option declares; nothing when it is registered nowhere, or is no class.

    Raises `BadInput` when a declaration is not made of literals.
    """
    file = registered(kind).get(name)
    found = classes_in(file).get((kind, name)) if file else None
    return read_class(file, found) if file and found else Declaration()


@cache
def read_class(file: Path, name: str) -> Declaration:
    """What a class in a file declares, with all that it inherits."""
    node = parse_class(file, name)
    if node is None:
        return Declaration()
    settings: dict[str, Setting] = {}
    for base in reversed(node.bases):
        place = place_of(file, ast.unparse(base))
        if place is not None:
            settings |= read_class(*place).settings
    for statement in node.body:
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            one = declared(statement, settings.get(statement.target.id), file)
            if one is not None:
                settings[statement.target.id] = one
    return Declaration(first_sentence(ast.get_docstring(node) or ""), settings)


def parse_class(file: Path, name: str) -> ast.ClassDef | None:
    """The syntax of one class, or None when the file has no class of this name."""
    text = text_of(file)
    start = start_of(name, text)
    if start < 0:
        return None
    end = END.search(text, start + 1)
    segment = text[start : end.start() if end else None]
    try:  # the rest is left out since a long file takes some milliseconds
        if segment.count('"""') % 2:
            raise SyntaxError("the line that is not indented stands in a string")
        body = ast.parse(METHOD.sub("    def _(): ...\n", segment)).body
    except SyntaxError:
        try:
            body = ast.parse(text).body
        except SyntaxError as error:
            raise BadInput(f"{file}, line {error.lineno}: {error.msg}") from None
    classes = (node for node in body if isinstance(node, ast.ClassDef) and node.name == name)
    return next(classes, None)


def start_of(name: str, text: str) -> int:
    """Where the line of a class begins in a text, -1 when there is none of this name."""
    return max(f"\n{text}".find(f"\nclass {name}{mark}") for mark in "(:")


def declared(statement: ast.AnnAssign, inherited: Setting | None, file: Path) -> Setting | None:
    """The setting that a field declares, or None when it is none that can be read."""
    value = statement.value
    if value is None or "ClassVar" in ast.unparse(statement.annotation):
        return None
    if ast.unparse(statement.target) == SEED:
        return None
    if isinstance(value, ast.Call) and ast.unparse(value.func).endswith("setting"):
        try:
            arguments = [ast.literal_eval(one) for one in value.args]
            words = {str(one.arg): ast.literal_eval(one.value) for one in value.keywords}
            return Setting(*arguments, **words)
        except (ValueError, TypeError) as error:
            key = ast.unparse(statement.target)
            raise BadInput(f"{file}: {key}: literals are needed in setting(): {error}") from None
    try:
        default = ast.literal_eval(value)
    except ValueError:
        return None
    return replace(inherited, default=default) if inherited else Setting(default, "")


def place_of(file: Path, name: str) -> tuple[Path, str] | None:
    """File and name of a class that another file names, or None when it comes from elsewhere."""
    if start_of(name, text_of(file)) >= 0:
        return file, name
    first, _, rest = name.partition(".")
    for module, imported in IMPORT.findall(text_of(file)):
        for part in re.sub(r"#.*", "", imported).strip("() \n").split(","):
            words = part.split()  # Name, or Name as another
            if words and words[-1] == first:
                where = file_of(f"{module}.{words[0]}" if rest else PUBLIC.get(words[0], module))
                return place_of(where, rest or words[0]) if where else None
    return None


def file_of(module: str) -> Path | None:
    """Source file of a module, without importing it."""
    module = MOVED.get(module, module)
    top, *parts = module.split(".")
    folder = PACKAGE if top == PACKAGE.name else folder_of(top)
    if folder is None:
        return None
    path = folder.joinpath(*parts)
    candidates = (path.with_suffix(".py") if parts else path / "__init__.py", path / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)


@cache
def folder_of(package: str) -> Path | None:
    """Folder of an installed package."""
    spec = find_spec(package)
    return Path(spec.origin).parent if spec and spec.origin and spec.has_location else None


def first_sentence(text: str) -> str:
    """The first sentence of a text."""
    paragraph = " ".join(text.partition("\n\n")[0].split())
    return re.split(r"(?<=\.)(?<!\b(?:St|al)\.) +(?=[A-Z])", paragraph, maxsplit=1)[0]


def with_preset(settings: dict[str, Setting], preset: dict[str, Any]) -> dict[str, Setting]:
    """Settings with the defaults of a YAML file; a key that the class lacks is one too."""
    return settings | {
        key: replace(settings[key], default=value) if key in settings else Setting(value, "")
        for key, value in preset.items()
    }
