"""Count habits of the code that cost readers a second look; `make check` fails if one of them grows.

* classes: names of public classes that more than one module has
* participles: functions and methods named by a participle (`played`), where an imperative (`play`) says who acts
* one: loop variables called `one`, where the thing has a name
* packed: assignments of several unlike values in one line
* phrases: turns of phrase that have to be read twice, in docstrings, comments, texts and pages

    python -m bench house                   the numbers, and their limits
    python -m bench house --where packed    each place of one kind

A number that shrank is written into `LIMITS`, so that it does not grow again.
"""

from __future__ import annotations

import ast
import re
import sys
from collections import defaultdict
from typing import TYPE_CHECKING, Final

from bench.command_line import make_parser
from bench.paths import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

PACKAGES: Final = ("khala_sc2", "agents", "bridge", "configs", "orchestrator", "protocol", "simulator")
LIMITS: Final = {"classes": 6, "participles": 20, "one": 0, "packed": 0, "phrases": 0}
PHRASES: Final = (
    r"gone on with", r"who has its \w+ can be", r"what there is of it", r"came to nothing", r"what would have been if",
    r"for whoever", r"comes? to be\b", r"less is nothing", r"hang together", r"nobody is waited for",
    r"holds nobody up", r"\bscripted has\b", r"is a sentence\b",
)  # fmt: skip
_PHRASE: Final = re.compile("|".join(PHRASES), re.IGNORECASE)
_PARTICIPLE: Final = re.compile(
    r"_?[a-z]+(?:[^e]ed|awn|ought|sent|made|kept|held|told|said|given|taken|written|shown|bound)$"
)


def places(kind: str) -> Iterator[str]:
    """Yield each place of a habit, as a file and a line."""
    if kind == "classes":
        yield from _classes()
        return
    for file in _sources():
        text = file.read_text(encoding="utf-8")
        where = file.relative_to(ROOT)
        if kind == "phrases":
            numbers = (number for number, line in enumerate(text.splitlines(), start=1) if _PHRASE.search(line))
        else:
            numbers = (getattr(node, "lineno", 0) for node in ast.walk(ast.parse(text)) if _FOUND[kind](node))
        yield from (f"{where}:{number}" for number in numbers)
    if kind == "phrases":
        for page in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")):
            lines = page.read_text(encoding="utf-8").splitlines()
            yield from (
                f"{page.relative_to(ROOT)}:{number}" for number, line in enumerate(lines, 1) if _PHRASE.search(line)
            )


def _sources() -> Iterator[Path]:
    for package in PACKAGES:
        yield from (file for file in sorted((ROOT / package).rglob("*.py")) if "build" not in file.parts)


def _classes() -> Iterator[str]:
    found: dict[str, list[str]] = defaultdict(list)
    for file in _sources():
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(f"{file.relative_to(ROOT)}:{node.lineno}")
    yield from (f"{name}: {', '.join(at)}" for name, at in sorted(found.items()) if len(at) > 1)


def _is_participle(node: ast.AST) -> bool:
    return isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and _PARTICIPLE.match(node.name) is not None


def _is_one(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and node.id == "one" and isinstance(node.ctx, ast.Store)


def _is_packed(node: ast.AST) -> bool:
    if not (isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple)):
        return False
    (target, *_) = node.targets
    if not isinstance(target, ast.Tuple) or not all(isinstance(name, ast.Name | ast.Attribute) for name in target.elts):
        return False
    return not _swaps(target, node.value) and not _is_alike(node.value)


def _is_alike(values: ast.Tuple) -> bool:
    """Return whether all values are made in the same way, as the two numbers of a point are."""
    return len({_shape(value) for value in values.elts}) == 1


def _shape(node: ast.expr) -> str:
    if isinstance(node, ast.Call):
        return f"call of {ast.unparse(node.func).rpartition('.')[2]}"
    if isinstance(node, ast.Constant):
        return type(node.value).__name__
    return type(node).__name__


def _swaps(target: ast.Tuple, value: ast.Tuple) -> bool:
    """Return whether an assignment needs its values at once, as a swap does."""
    written = {ast.unparse(name) for name in target.elts}
    return any(ast.unparse(node) in written for part in value.elts for node in ast.walk(part) if hasattr(node, "ctx"))


_FOUND: Final = {"participles": _is_participle, "one": _is_one, "packed": _is_packed}


def main() -> int:
    """Run the command line."""
    parser = make_parser(__doc__, json=False)
    parser.add_argument("--where", choices=LIMITS, help="list the places of one kind")
    given = parser.parse_args()
    if given.where:
        print(*places(given.where), sep="\n")
        return 0
    grown = []
    for kind, limit in LIMITS.items():
        number = sum(1 for _ in places(kind))
        print(f"{kind:12} {number:5}  of at most {limit}")
        if number > limit:
            grown.append(kind)
    for kind in grown:
        print(f"{kind} grew: `python -m bench house --where {kind}` lists them", file=sys.stderr)
    return 1 if grown else 0
