"""The examples for clusters: the manifest for KubeRay is one, the script for Slurm is one, and both call Khala."""

from __future__ import annotations

import re
import shlex
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
import typer.main
import yaml
from check_jsonschema import main as check_jsonschema  # type: ignore[import-untyped]  # it is no library
from click.testing import CliRunner

from khala_sc2.cli import app
from khala_sc2.experiment.engine import MATCH_MB

ROOT = Path(__file__).resolve().parents[2]
MANIFEST, SCRIPT = ROOT / "docs" / "deploy" / "kuberay.yaml", ROOT / "docs" / "deploy" / "slurm.sh"
SCHEMA = ROOT / "tests" / "deploy" / "rayjob.schema.json"
CLAIM, JOB = yaml.safe_load_all(MANIFEST.read_text())
CLUSTER: dict[str, Any] = JOB["spec"]["rayClusterSpec"]
HEAD, WORKER = (
    group["template"]["spec"]["containers"][0] for group in (CLUSTER["headGroupSpec"], *CLUSTER["workerGroupSpecs"])
)


def complaints(job: object, directory: Path) -> str:
    """Return what the schema says against a RayJob; empty if nothing is wrong."""
    (file := directory / "job.yaml").write_text(yaml.safe_dump(job))
    done = CliRunner().invoke(check_jsonschema, ["--schemafile", str(SCHEMA), str(file)], catch_exceptions=False)
    return done.stdout if done.exit_code else ""


def test_the_manifest_is_what_kuberay_wants(tmp_path: Path) -> None:
    assert complaints(JOB, tmp_path) == ""


@pytest.mark.parametrize(
    ("right", "wrong", "complaint"),
    [
        ("headGroupSpec:", "headGroup:", "'headGroupSpec' is a required property"),
        ('num-cpus: "0"', "num-cpus: 0", "0 is not of type 'string'"),
        ("minReplicas: 3", "", "'minReplicas' is a required property"),
        ("image: registry", "imag: registry", "'image' is a required property"),
    ],
)
def test_a_mistake_in_the_manifest_would_be_found(tmp_path: Path, right: str, wrong: str, complaint: str) -> None:
    text = MANIFEST.read_text()
    assert right in text
    _, job = yaml.safe_load_all(text.replace(right, wrong))
    assert complaint in complaints(job, tmp_path)


def test_what_is_recorded_outlives_the_cluster_and_a_second_try_finds_it() -> None:
    words = shlex.split(JOB["spec"]["entrypoint"])
    (mount,) = HEAD["volumeMounts"]
    (volume,) = CLUSTER["headGroupSpec"]["template"]["spec"]["volumes"]
    assert words[words.index("--out") + 1] == mount["mountPath"]
    assert (mount["name"], volume["persistentVolumeClaim"]["claimName"]) == (volume["name"], CLAIM["metadata"]["name"])


def test_a_node_has_memory_for_a_match_on_each_core_beside_what_ray_keeps() -> None:
    limits = WORKER["resources"]["limits"]
    assert int(limits["cpu"]) * MATCH_MB < 0.5 * 1024 * int(limits["memory"].removesuffix("Gi"))


def test_the_manifest_has_the_image_and_the_ray_that_we_build() -> None:
    locked = {one["name"]: one["version"] for one in tomllib.loads((ROOT / "uv.lock").read_text())["package"]}
    assert CLUSTER["rayVersion"] == locked["ray"]
    assert HEAD["image"] == WORKER["image"]
    assert 'ARG EXTRAS=""' in (ROOT / "Dockerfile").read_text()
    assert f'EXTRAS="--extra ray" --tag {HEAD["image"]} .' in MANIFEST.read_text()


def test_the_script_is_one() -> None:
    subprocess.run(["bash", "-n", SCRIPT], check=True)


@pytest.mark.parametrize(
    "command", [JOB["spec"]["entrypoint"], re.findall(r"^  (khala .*)$", SCRIPT.read_text(), re.MULTILINE)[0]]
)
def test_the_command_of_an_example_can_be_given(command: str) -> None:
    _, group, name, *words = shlex.split(command)
    found: Any = typer.main.get_command(app)
    with found.commands[group].commands[name].make_context(name, words) as context:
        assert context.params["on"] == "ray"
        assert context.params["address"]
