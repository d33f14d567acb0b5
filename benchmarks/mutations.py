"""Small changes of a program that its tests should notice: where they can be made, and a sample of them."""

import ast
import hashlib
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

# How many of a hundred mutants are drawn in each room of the package.
ROOMS = {"core": 52, "analysis": 8, "problems": 14, "runs": 14, "report": 12}
# Numbers in these files are the looks of a page: sizes, positions, colours.
LOOKS = "report/"

OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Lt: ("<", ">="),
    ast.LtE: ("<=", ">"),
    ast.Gt: (">", "<="),
    ast.GtE: (">=", "<"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
}
LEFT_ALONE = (ast.Raise, ast.Assert, ast.JoinedStr, ast.Import, ast.ImportFrom)
OPPOSITES = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum"}


@dataclass(frozen=True)
class Mutant:
    """One change of one file: `before` at `start` becomes `after`."""

    path: str  # in the package
    start: int  # in characters
    before: str
    after: str
    kind: str
    line: int
    where: str  # the function or class around it
    text: str  # the line, without its indentation

    @property
    def name(self) -> str:
        """The same as long as the line stays the same, wherever it stands."""
        column = self.text.find(self.before.split("\n")[0])
        parts = (self.path, self.where, self.text, str(column), self.before, self.after, self.kind)
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:10]

    def apply(self, source: str) -> str:
        """The source with the change."""
        stop = self.start + len(self.before)
        assert source[self.start : stop] == self.before
        return source[: self.start] + self.after + source[stop:]


class Finder(ast.NodeVisitor):
    """All mutants of one file; messages, annotations and texts are left alone."""

    def __init__(self, path: str, source: str) -> None:
        self.path, self.source = path, source
        self.lines = source.splitlines(keepends=True)
        self.starts = [0]
        for line in self.lines:
            self.starts.append(self.starts[-1] + len(line))
        self.scope: list[str] = []
        self.found: list[Mutant] = []

    def place(self, line: int, column: int) -> int:
        """Position in characters of a line and a column in bytes, as `ast` counts."""
        before = self.lines[line - 1].encode()[:column].decode()
        return self.starts[line - 1] + len(before)

    def span(self, node: ast.AST) -> tuple[int, int]:
        return (
            self.place(node.lineno, node.col_offset),
            self.place(node.end_lineno, node.end_col_offset),
        )

    def add(self, node: ast.AST, start: int, before: str, after: str, kind: str) -> None:
        line = self.source.count("\n", 0, start) + 1
        text = self.lines[line - 1].strip()
        where = ".".join(self.scope)
        self.found.append(Mutant(self.path, start, before, after, kind, line, where, text))

    def replace(self, node: ast.AST, after: str, kind: str) -> None:
        start, stop = self.span(node)
        self.add(node, start, self.source[start:stop], after, kind)

    def between(self, left: ast.AST, right: ast.AST, operator: ast.AST, kind: str) -> None:
        """Exchange the operator that stands between two operands."""
        if type(operator) not in OPERATORS:
            return
        before, after = OPERATORS[type(operator)]
        start, stop = self.span(left)[1], self.span(right)[0]
        offset = self.source[start:stop].find(before)
        if offset >= 0 and "#" not in self.source[start : start + offset]:
            self.add(left, start + offset, before, after, kind)

    def visit_scope(self, node: ast.FunctionDef | ast.ClassDef) -> None:
        self.scope.append(node.name)
        body = node.body
        if isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
            body = body[1:]
        procedure = isinstance(node, ast.FunctionDef) and not any(
            isinstance(part, (ast.Yield, ast.YieldFrom))
            or (isinstance(part, ast.Return) and part.value is not None)
            for part in ast.walk(node)
        )
        if procedure and len(body) > 1:
            start = self.span(body[0])[0]
            self.add(body[0], start, "", "return; ", "return early")
        for decorator in node.decorator_list:
            if "dataclass" not in ast.unparse(decorator):
                self.visit(decorator)
        if isinstance(node, ast.FunctionDef):
            for default in [*node.args.defaults, *filter(None, node.args.kw_defaults)]:
                self.visit(default)
        for statement in body:
            self.visit(statement)
        self.scope.pop()

    def visit(self, node: ast.AST) -> None:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            self.visit_scope(node)
        elif not isinstance(node, LEFT_ALONE):
            super().visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        self.between(node.left, node.right, node.op, "arithmetic")
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        for left, operator, right in zip(
            [node.left, *node.comparators], node.ops, node.comparators, strict=False
        ):
            self.between(left, right, operator, "comparison")
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        self.between(node.values[0], node.values[1], node.op, "and, or")
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, (ast.USub, ast.Not)):
            start, stop = self.span(node)[0], self.span(node.operand)[0]
            self.add(node, start, self.source[start:stop].rstrip("("), "", "sign")
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        if type(node.op) in OPERATORS:
            before, after = OPERATORS[type(node.op)]
            start, stop = self.span(node.target)[1], self.span(node.value)[0]
            offset = self.source[start:stop].find(f"{before}=")
            self.add(node, start + offset, f"{before}=", f"{after}=", "arithmetic")
        self.replace(node, "pass", "dropped statement")
        self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        if any(isinstance(target, ast.Subscript) for target in node.targets):
            self.replace(node, "pass", "dropped statement")
        self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call):
            self.replace(node, "pass", "dropped statement")
        self.generic_visit(node)

    def visit_If(self, node: ast.If) -> None:
        if not (isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"):
            self.replace(node.test, "False", "condition")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        name = node.func.id if isinstance(node.func, ast.Name) else name
        if name in OPPOSITES:
            stop = self.span(node.func)[1]
            self.add(node, stop - len(name), name, OPPOSITES[name], "min, max")
        self.generic_visit(node)

    def visit_Subscript(self, node: ast.Subscript) -> None:
        part = node.slice
        if isinstance(part, ast.Tuple) and isinstance(node.ctx, ast.Load):
            names = [e for e in part.elts if isinstance(e, (ast.Name, ast.Constant))]
            for one, other in pairwise(names):
                first, second = ast.unparse(one), ast.unparse(other)
                if first != second:
                    (start, _), (_, stop) = self.span(one), self.span(other)
                    before = self.source[start:stop]
                    gap = before[len(first) : len(before) - len(second)]
                    self.add(node, start, before, f"{second}{gap}{first}", "swapped indices")
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool):
            self.replace(node, str(not value), "constant")
        elif isinstance(value, (int, float)) and not self.path.startswith(LOOKS):
            after = value + 1 if isinstance(value, int) else (2.0 * value or 1.0)
            self.replace(node, repr(after), "constant")


def mutants_of(path: str, source: str) -> list[Mutant]:
    """All mutants of one file, `path` in the package."""
    finder = Finder(path, source)
    finder.visit(ast.parse(source))
    return finder.found


def compiles(source: str) -> bool:
    try:
        ast.parse(source)
    except SyntaxError:
        return False
    return True


def draw(package: Path, seed: int, rooms: dict[str, int] = ROOMS) -> Iterator[Mutant]:
    """All mutants in an order that the seed decides, rooms by their weights.

    In a room a file weighs as much as it has places, and in a file all kinds of changes weigh the
    same: else two thirds of all mutants would be changed constants. Every mutant waits for a time
    that its own name decides, so that the order of the others stays when some lines change.
    """
    waiting: list[tuple[float, str, Mutant]] = []
    sources = {}
    for room, share in rooms.items():
        places: list[tuple[float, Mutant]] = []
        for file in sorted((package / room).rglob("*.py")):
            path, source = str(file.relative_to(package)), file.read_text(encoding="utf-8")
            sources[path], found = source, mutants_of(path, source)
            kinds = Counter(mutant.kind for mutant in found)
            places += [(len(found) / len(kinds) / kinds[one.kind], one) for one in found]
        total = sum(weight for weight, _ in places)
        for weight, mutant in places:
            digest = hashlib.sha256(f"{seed} {mutant.name}".encode()).hexdigest()[:13]
            time = -math.log((int(digest, 16) + 1) / 16**13) * total / (weight * share)
            waiting.append((time, mutant.name, mutant))
    seen: set[str] = set()
    for _, name, mutant in sorted(waiting, key=lambda one: one[:2]):
        if name not in seen and compiles(mutant.apply(sources[mutant.path])):
            seen.add(name)
            yield mutant
