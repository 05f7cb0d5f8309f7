"""Code that a file names runs only if the user trusts it."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from khala_protocol.errors import ConfigError
from khala_protocol.trust import Untrusted, check_trusted, import_trusted, is_trusted, trust, trust_files, trust_named

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A module in the current directory that leaves a file when it runs."""
    (tmp_path / "foreign_code.py").write_text("open('it-ran', 'w').close()\n")
    monkeypatch.chdir(tmp_path)
    before = list(sys.path)
    yield "foreign_code"
    sys.path[:] = before
    sys.modules.pop("foreign_code", None)


def test_a_module_that_nobody_trusts_does_not_run(module: str, tmp_path: Path) -> None:
    with pytest.raises(Untrusted) as caught:
        import_trusted(module, source="task.yaml")
    assert str(caught.value) == (
        "task.yaml: this names the code 'foreign_code', which would run on this machine: if you trust it, say --trust, "
        "or set KHALA_TRUST=foreign_code"
    )
    assert not (tmp_path / "it-ran").exists()


def test_what_the_user_names_is_trusted_and_nothing_else(module: str, tmp_path: Path) -> None:
    trust_named("foreign_code:decide", "silent", "scripted/skilled", None)
    assert os.environ["KHALA_TRUST"] == "foreign_code"
    import_trusted(module, source="--policy")
    assert (tmp_path / "it-ran").exists()
    assert not is_trusted("os")


def test_the_option_trusts_what_files_name() -> None:
    trust_files(trusted=False)
    assert not is_trusted("anything")
    trust_files(trusted=True)
    assert is_trusted("anything")


def test_a_command_with_commas_is_trusted_as_a_whole() -> None:
    trust("python run.py --races p,t,z")
    assert is_trusted("python run.py --races p,t,z")
    assert not is_trusted("t")
    with pytest.raises(Untrusted, match="'rm -r'"):
        check_trusted(["rm -r"])


def test_no_file_of_the_current_directory_stands_in_for_a_library(module: str, tmp_path: Path) -> None:
    (tmp_path / "json.py").write_text("raise SystemExit('shadowed')\n")
    code = (
        "import sys; from khala_protocol.trust import trust, import_trusted; trust('foreign_code'); "
        "import_trusted('foreign_code', source=''); sys.modules.pop('json', None); import json"
    )
    subprocess.run([sys.executable, "-P", "-c", code], check=True, timeout=60)


def test_an_import_that_fails_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "half_written.py").write_text("raise RuntimeError('half written')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    trust("half_written", "nowhere")
    with pytest.raises(ConfigError, match="policy x: importing it failed: RuntimeError: half written"):
        import_trusted("half_written", source="policy x")
    with pytest.raises(ConfigError, match="policy x: there is no module 'nowhere'"):
        import_trusted("nowhere", source="policy x")
