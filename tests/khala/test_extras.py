"""Where a package of an extra is missing, every door says so in a sentence with the command that installs it here."""

from __future__ import annotations

import importlib.metadata
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from khala_protocol import extras
from khala_protocol.errors import ConfigError, NotInstalled
from khala_protocol.extras import install_command, needs, requirements

if TYPE_CHECKING:
    from collections.abc import Sequence

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = str(ROOT / "tests" / "khala" / "golden.mcap")
MISSING = {
    "data": ("pyarrow", "tiktoken", "tokenizers"),
    "env": ("gymnasium", "pettingzoo"),
    "inspect": ("inspect_ai",),
    "mcp": ("mcp",),
    "openenv": ("openenv",),
    "otlp": ("opentelemetry.exporter",),
    "ray": ("ray",),
    "socks": ("socksio",),
}
"""The extras, and the import names of which at least one stands behind each door."""

COMMANDS = {
    "khala mcp": ("mcp", "mcp", ("mcp", "2s3z_pair")),
    "khala openenv": ("openenv", "openenv", ("openenv", "2s3z", "--port", "0")),
    "khala dataset export": ("data", "pyarrow", ("dataset", "export", GOLDEN, "--out", "o", "--format", "parquet")),
    "khala dataset export --tokenizer": (
        "data", "tokenizers", ("dataset", "export", GOLDEN, "--out", "o", "--tokenizer", "hub/name"),
    ),
    "khala serve": ("otlp", "opentelemetry", ("serve", "--otlp", "http://127.0.0.1:1", "--listen", "tcp/127.0.0.1:0")),
    "khala experiment run": ("ray", "ray", ("experiment", "run", "smoke", "--on", "ray", "--yes")),
    "khala experiment join": ("ray", "ray", ("experiment", "join", "127.0.0.1:1")),
}  # fmt: skip
"""Doors of the command line: their extra, the package that the sentence names, and how they are opened."""
IMPORTS = {
    "khala_sc2.env": ("env", "pettingzoo"),
    "khala_sc2.env.numeric": ("env", "pettingzoo"),
    "khala_sc2.inspect.tasks": ("inspect", "inspect_ai"),
    "khala_sc2.openenv.client": ("openenv", "openenv"),
}
"""Modules that README and the guides import, and that inspect_ai finds."""

BLOCK = """
import sys
sys.modules.update(dict.fromkeys({packages!r}))
sys.argv = ["khala", *{words!r}]
"""


def run(script: str, words: Sequence[str], packages: Sequence[str], place: Path) -> str:
    """Run a script without some packages; return what it says on stderr."""
    block = BLOCK.format(packages=tuple(packages), words=tuple(words))
    done = subprocess.run(
        [sys.executable, "-c", block + script], cwd=place, capture_output=True, text=True, check=False
    )
    assert done.returncode, done.stdout
    return done.stderr


@pytest.mark.parametrize(
    "door", [pytest.param(door, marks=[] if door == "khala mcp" else [pytest.mark.slow]) for door in COMMANDS]
)
def test_a_command_says_what_to_install(door: str, tmp_path: Path) -> None:
    extra, package, words = COMMANDS[door]
    said = run("import khala_sc2.cli; khala_sc2.cli.main()", words, MISSING[extra], tmp_path)
    assert f": {package} is not installed; this installs it: " in said, said
    assert "Traceback" not in said
    assert said.strip().endswith(install_command(extra))


@pytest.mark.parametrize(
    "door", [pytest.param(door, marks=[] if door.endswith("numeric") else [pytest.mark.slow]) for door in IMPORTS]
)
def test_a_module_says_what_to_install(door: str, tmp_path: Path) -> None:
    extra, package = IMPORTS[door]
    said = run(f"import {door}", (), MISSING[extra], tmp_path)
    assert f": {package} is not installed; this installs it: " in said, said
    assert said.strip().endswith(install_command(extra))


def test_every_extra_has_a_door() -> None:
    declared = set(importlib.metadata.metadata("khala-sc2").get_all("Provides-Extra") or ())
    assert declared == set(MISSING)
    # that of the proxies is tests/agents/llm/test_network.py
    assert {extra for extra, *_ in (*COMMANDS.values(), *IMPORTS.values())} == declared - {"socks"}


@pytest.mark.parametrize("extra", MISSING)
def test_an_extra_names_packages_of_others(extra: str) -> None:
    found = requirements(extra)
    assert found
    assert not [requirement for requirement in found if requirement.startswith("khala")]


def installed_from(monkeypatch: pytest.MonkeyPatch, origin: dict[str, Any] | None, prefix: Path) -> None:
    """Have this installation say where it came from, and lie in that environment."""
    monkeypatch.setattr(
        importlib.metadata.PathDistribution, "read_text",
        lambda _, name: json.dumps(origin) if origin and name == "direct_url.json" else None,
    )  # fmt: skip
    monkeypatch.setattr(extras, "requirements", lambda _: ["mcp>=2.3"])
    monkeypatch.setattr(sys, "prefix", str(prefix))
    monkeypatch.setattr(sys, "executable", str(prefix / "python"))


@pytest.mark.parametrize("has_pip", [True, False])
def test_an_installation_from_wheels_is_told_the_packages(
    has_pip: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed_from(monkeypatch, None, tmp_path)
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: has_pip or None)
    python = tmp_path / "python"
    pip = f"{python} -m pip install" if has_pip else f"uv pip install --python {python}"
    assert install_command("mcp") == f"{pip} 'mcp>=2.3'"


@pytest.mark.parametrize("has_uv", [True, False])
def test_a_clone_is_told_the_command_of_uv(has_uv: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = tmp_path / ".uv" / "bin" / "uv"
    own.parent.mkdir(parents=True)
    own.touch()
    monkeypatch.setenv("PATH", str(own.parent) if has_uv else os.devnull)
    if has_uv:
        own.chmod(0o700)
    installed_from(monkeypatch, {"url": tmp_path.as_uri(), "dir_info": {"editable": True}}, tmp_path / ".venv")
    uv = "uv" if has_uv else own
    assert install_command("mcp") == f"{uv} sync --directory {tmp_path} --frozen --inexact --extra mcp"


def test_a_mistake_of_ours_stays_one() -> None:
    with pytest.raises(ModuleNotFoundError, match="khala_sc2"), needs("mcp", source="khala mcp"):
        import khala_sc2.nowhere  # type: ignore[import-not-found]  # noqa: F401


def test_the_error_is_for_people_and_for_who_imports() -> None:
    assert issubclass(NotInstalled, ConfigError)
    assert issubclass(NotInstalled, ImportError)
