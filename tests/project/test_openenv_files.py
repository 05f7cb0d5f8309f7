"""The directory that OpenEnv's own tools read: `openenv validate` passes, and image and manifest belong together."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path
from typing import Any

import typer.main
import yaml
from openenv.cli.__main__ import app as openenv
from typer.testing import CliRunner

from khala_sc2.cli import app

HERE = Path(__file__).resolve().parents[2] / "envs" / "khala_env"
MANIFEST: dict[str, Any] = yaml.safe_load((HERE / "openenv.yaml").read_text())


def instruction(name: str) -> str:
    """Return the value of the only instruction of this name in the Dockerfile."""
    text = re.sub(r"\\\n\s*", "", (HERE / "server" / "Dockerfile").read_text())
    (found,) = re.findall(rf"^{name} (.*)$", text, re.MULTILINE)
    return str(found)


def test_openenv_validate_passes_and_finds_every_way_to_deploy() -> None:
    done = CliRunner().invoke(openenv, ["validate", str(HERE), "--verbose"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert "Ready for multi-mode deployment" in done.output
    assert done.output.count("[YES]") == 4


def test_the_manifest_names_an_application_that_serves_openenv() -> None:
    module, _, name = MANIFEST["app"].partition(":")
    spec = importlib.util.spec_from_file_location("khala_env_app", HERE / f"{module.replace('.', '/')}.py")
    assert spec is not None and spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    assert {"/reset", "/step", "/state"} <= getattr(loaded, name).openapi()["paths"].keys()


def test_the_image_runs_a_command_that_can_be_given_at_the_port_of_the_manifest() -> None:
    program, command, *words = json.loads(instruction("ENTRYPOINT"))
    assert (program, command) == ("khala", "openenv")
    known: Any = typer.main.get_command(app)
    with known.commands[command].make_context(command, [*words, *json.loads(instruction("CMD"))]) as context:
        assert context.params["port"] == MANIFEST["port"] == int(instruction("EXPOSE"))
        assert context.params["host"] == "0.0.0.0"
        made = re.findall(r"khala sc2 install (\S+)", (HERE.parents[1] / "Dockerfile").read_text())
        assert [context.params["game"]] == made
    assert f"127.0.0.1:{MANIFEST['port']}/health" in instruction("HEALTHCHECK")


def test_the_image_is_made_of_one_that_the_repository_makes_with_the_extra() -> None:
    (extra, tag) = re.findall(
        r'--build-arg EXTRAS="--extra (\w+)" -t (\S+) \.', (HERE / "server/Dockerfile").read_text()
    )[0]
    assert (extra, instruction("ARG")) == ("openenv", f"KHALA_IMAGE={tag}")
    assert instruction("FROM") == "${KHALA_IMAGE}"
