"""Files that hold prompts, replies or results are written in one place, for their user alone."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
PACKAGES = ("agents/khala_agents", "bridge/khala_bridge", "orchestrator/khala_orchestrator",
            "protocol/khala_protocol", "khala_sc2", "envs")  # fmt: skip
PLACES = {
    "protocol/khala_protocol/files.py": "the place",
    "protocol/khala_protocol/certificates.py": "makes its files with their modes",
    "protocol/khala_protocol/recording/recorder.py": "never writes over a file, and makes it with its mode",
    "agents/khala_agents/commands.py": "the address of an endpoint, which other users may read",
    "bridge/khala_bridge/catalogue/functions.py": "a file of this repository",
    "khala_sc2/knowledge/files.py": "files of this repository",
    "khala_sc2/experiment/ray_engine.py": "writes to a URL, and makes a file of this machine with its mode",
}
HINT = re.compile(r"\.write_(text|bytes)\(|\bopen\(|mkdir\(|copyfile|copytree")


def faults(source: str) -> Iterator[str]:
    """Yield what a module creates with the mode that the umask says."""
    if not HINT.search(source):  # most modules write nothing, and to parse them all takes seconds
        return
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute | ast.Name):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else node.func.id
            words = [one.value for one in node.args if isinstance(one, ast.Constant) and isinstance(one.value, str)]
            opens = name == "open" and any(re.fullmatch("[wax]b?[+]?", word) for word in words)
            makes = name == "mkdir" and "mode" not in {keyword.arg for keyword in node.keywords}
            if opens or makes or name in {"write_text", "write_bytes", "copyfile", "copytree"}:
                yield f"{node.lineno}: {name}"


def modules() -> dict[str, str]:
    found = (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")))
    return {str(path.relative_to(ROOT)): path.read_text() for path in found}


def test_files_are_written_in_one_place() -> None:
    found = modules()
    assert len(found) > 250
    wrong = [f"{name}:{fault}" for name, text in found.items() if name not in PLACES for fault in faults(text)]
    assert not wrong, "write with `khala_protocol.files`"
    assert not [name for name in PLACES if name not in found]


@pytest.mark.parametrize(
    "line",
    [
        "path.write_text(text)",
        "path.open('w')",
        "open(path, 'ab')",
        "path.mkdir(parents=True)",
        "copyfile(a, b)",
    ],
)
def test_a_way_past_it_is_found(line: str) -> None:
    assert list(faults(line))
