"""Our names: what files tell people to install is ours, and the guide and the workflow list all that we build."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
WORKFLOW = yaml.safe_load((ROOT / ".github" / "workflows" / "wheels.yml").read_text(encoding="utf-8"))
MEMBERS = ("agents", "bridge", "configs", "orchestrator", "protocol", "simulator")

INSTALL = re.compile(r"(?:pip|uv tool|pipx|uv) (?:install|add)\b([^`#\n]*)|(?:uvx|pipx run)\b([^`#\n]*)")
OURS = re.compile(r"(?<![\w./~-])khala[\w.-]*(?:\[[\w,]+\])?(?=['\"\s]|$)", re.IGNORECASE)
FOLDER = "--find-links dist"
"""The guide installs wheels by path before it names an extra so, see docs/how-to/install.md."""


def strange(line: str) -> list[str]:
    """Return the names of ours that a line has an index look up."""
    found = []
    for install, run in INSTALL.findall(line):
        if FOLDER not in install:
            found += OURS.findall(install)
        if "--from" not in run and "pipx" not in line:
            found += OURS.findall(run.strip().partition(" ")[0])
        elif "--from" in run:
            found += OURS.findall(run.partition("--from")[2].strip().partition(" ")[0])
    return found


def test_no_file_installs_a_name_that_is_not_ours() -> None:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    found = []
    for name in listed.splitlines():
        path = ROOT / name
        if path.suffix in {".md", ".py", ".sh", ".yml", ".yaml", ".ipynb", ".toml"} and path != Path(__file__):
            lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
            found += [f"{name}:{number}: {line}" for number, line in enumerate(lines, start=1) if strange(line)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("pip install khala", ["khala"]),
        ("run `pip install 'khala-sc2[mcp]'` first", ["khala-sc2[mcp]"]),
        ("pip install dist/khala_sc2_agents-*.whl", []),
        ("pip install --find-links dist 'khala-sc2[mcp]'", []),
        ("python -m pip install 'mcp>=2.3'", []),
        ("uvx --from git+<this repository> khala run", []),
        ("uvx --from khala-sc2 khala run", ["khala-sc2"]),
        ("uvx khala run", ["khala"]),
    ],
)
def test_a_name_that_an_index_would_look_up_is_found(line: str, names: list[str]) -> None:
    assert strange(line) == names


def distributions() -> set[str]:
    """Return the names of what the repository builds for others."""
    files = [ROOT / "pyproject.toml", *(ROOT / member / "pyproject.toml" for member in MEMBERS)]
    return {tomllib.loads(file.read_text(encoding="utf-8"))["project"]["name"] for file in files}


def test_the_makefile_the_guide_and_the_workflow_name_every_distribution() -> None:
    names = distributions()
    assert {name for name in names if not name.startswith("khala-sc2")} == set()
    made = re.findall(r"^DISTRIBUTIONS := (.*)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(made[0].split()) == names
    guide = (ROOT / "docs" / "how-to" / "install.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(khala-sc2[\w-]*)` \| `khala_", guide, re.MULTILINE)) == names
    built = " ".join(step.get("run", "") for step in WORKFLOW["jobs"]["rest"]["steps"])
    assert set(re.findall(r"khala-sc2[\w-]*", built)) == names


def test_a_release_is_published_by_identity_and_only_after_its_wheels_were_installed() -> None:
    publish = WORKFLOW["jobs"]["publish"]
    assert publish["if"] == "github.event_name == 'release'"
    assert publish["permissions"] == {"id-token": "write"}
    assert publish["environment"]
    assert set(publish["needs"]) == set(WORKFLOW["jobs"]) - {"publish"}
    assert "secrets." not in (ROOT / ".github" / "workflows" / "wheels.yml").read_text(encoding="utf-8")
    assert publish["steps"][-1]["with"]["attestations"] is True
    assert WORKFLOW["permissions"] == {"contents": "read"}
