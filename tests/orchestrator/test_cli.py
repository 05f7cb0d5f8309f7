"""What the lists of the command line say."""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import re
import signal
from pathlib import Path

import pytest

from khala_orchestrator.cli import replay, router, tasks
from khala_orchestrator.commands import access_rules, people
from khala_orchestrator.config import load_task
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.codec import encode
from khala_protocol.errors import BusError, ConfigError, RecordingError
from khala_protocol.messages import AgentReport, ImageRef, Observation, Report, View
from khala_protocol.recording import Recorder, Recording


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        ([], ""),
        (["Zealots", "Stalkers"], "Zealots, Stalkers"),
        (["Commander", "CombatGroup0", "CombatGroup1", "CombatGroup12"], "Commander, CombatGroup0 1 12"),
        (["CombatGroup", "CombatGroup2"], "CombatGroup 2"),
        (["2"], "2"),
    ],
)
def test_agents_that_differ_by_a_number_are_named_together(names: list[str], shown: str) -> None:
    assert people(names) == shown


def test_a_task_is_listed_with_its_agents_and_what_it_is_about(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    tasks()
    lines = capsys.readouterr().out.splitlines()
    first = lines.index("pvz_task5_level1  Commander, CombatGroup1 2 5 6")
    assert lines[first + 1].startswith("    LLM-PySC2 task 5, ")
    assert all(len(line) <= 80 for line in lines)


def test_tasks_are_data_for_a_program(capsys: pytest.CaptureFixture[str]) -> None:
    tasks(as_json=True)
    found = {task["name"]: task for task in json.loads(capsys.readouterr().out)["tasks"]}
    assert found["2s3z_pair"] == {
        "name": "2s3z_pair",
        "map": "2s3z",
        "agents": ["Stalkers", "Zealots"],
        "opponent": "computer (protoss, very_hard)",
        "description": load_task("2s3z_pair").description,
    }


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Three steps of two agents that say nothing."""
    agents = tuple(AgentReport(agent=name, side="blue", status="late") for name in ("Stalkers", "Zealots"))
    with Recorder(tmp_path / "run.mcap") as recorder:
        for step in range(3):
            seen = Observation(
                run="test", side="blue", agent="Stalkers", episode=0, step=step, game_loop=0, answer_within_s=None,
                text="[bold]nothing[/bold]", view=View(time_s=0.0),
            )  # fmt: skip
            recorder.write("khala/test/blue/Stalkers/observation", encode(seen))
            report = Report(run="test", episode=0, step=step, game_loop=224 * step, agents=agents)
            recorder.write("khala/test/report", encode(report))
    return recorder.path


def test_a_replay_tells_the_part_that_is_asked_for(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    replay([recording], agent="Stalkers", steps="1-")
    assert capsys.readouterr().out.splitlines() == [
        "step 1  0:10  score 0",
        "  Stalkers: late",
        "step 2  0:20  score 0",
        "  Stalkers: late",
    ]


def test_a_replay_word_for_word_shows_words_as_they_are(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    replay([recording], steps="0", text=True)
    assert capsys.readouterr().out.splitlines()[:2] == ["step 0, Stalkers sees", "  │ [bold]nothing[/bold]"]


def test_a_replay_as_data_is_one_object(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    replay([recording], steps="2", as_json=True)
    found = json.loads(capsys.readouterr().out)
    assert [report["step"] for report in found["reports"]] == [2]
    assert found["samples"] == {"khala/test/blue/Stalkers/observation": 3, "khala/test/report": 3}


def test_a_replay_for_its_pictures_says_where_they_are(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    replay([recording], images=tmp_path / "pictures", as_json=True)
    assert json.loads(capsys.readouterr().out) == {"pictures": []}
    monkeypatch.chdir(tmp_path)
    replay([recording], images=Path("pictures_of_it"))
    out, err = capsys.readouterr()
    assert (out, err) == ("", "0 pictures are in pictures_of_it\n")


def torn(recording: Path) -> Path:
    """Cut the end off a recording whose samples were flushed one by one."""
    path = recording.with_name("torn.mcap")
    with Recorder(path) as recorder:
        for sample in Recording.open(recording):
            recorder.write(sample.key, sample.payload)
            recorder.flush()
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 6])
    return path


def test_a_replay_says_that_a_recording_is_torn_and_after_which_sample(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = torn(recording)
    count = Recording.open(path).samples
    assert 0 < count < 6
    replay([path], as_json=True)
    out, err = capsys.readouterr()
    assert json.loads(out)["complete"] is False
    advice = "--recover NEW writes what can be read as a whole recording"
    assert err == f"{path} is torn or damaged after its sample {count}; {advice}\n"
    replay([recording], as_json=True)
    out, err = capsys.readouterr()
    assert (json.loads(out)["complete"], err) == (True, "")


def test_a_torn_recording_is_recovered_by_a_command(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, new = torn(recording), tmp_path / "whole.mcap"
    replay([path], new=new, as_json=True)
    count = Recording.open(path).samples
    assert json.loads(capsys.readouterr().out) == {"recording": str(new), "samples": count, "complete": False}
    assert Recording.open(new).complete
    with pytest.raises(RecordingError, match=r"whole\.mcap exists already"):
        replay([path], new=new)


@pytest.mark.posix
def test_a_pipe_is_no_recording(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RecordingError, match=r"pipe cannot be read: it is a pipe or a device: name a file$"):
        replay([tmp_path / "pipe"])


def test_pictures_stay_in_their_directory_whatever_they_are_called(tmp_path: Path) -> None:
    data = b"\x89PNG"
    picture = ImageRef(
        name="/../../out", media_type="image/png", sha256=hashlib.sha256(data).hexdigest(), width=1, height=1, bytes=4
    )
    directory = tmp_path / "below" / "pictures"
    (directory / "0-0000-A-").mkdir(parents=True)
    with Recorder(tmp_path / "run.mcap") as recorder:
        seen = Observation(
            run="test", side="blue", agent="A", episode=0, step=0, game_loop=0, answer_within_s=None, text="",
            view=View(time_s=0.0), images=(picture,),
        )  # fmt: skip
        recorder.write("khala/test/blue/A/image/0", data)
        recorder.write("khala/test/blue/A/observation", encode(seen))
    replay([tmp_path / "run.mcap"], images=directory)
    assert [path.name for path in tmp_path.rglob("*.png")] == ["0-0000-A-_.._.._out.png"]
    assert len(list(directory.glob("*.png"))) == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_router_says_where_it_listens_and_ends_at_a_signal(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []

    def hear(line: str) -> None:
        said.append(line)
        signal.raise_signal(number)

    monkeypatch.setattr("khala_orchestrator.cli.typer.echo", hear)
    router(listen=["tcp/127.0.0.1:0"], as_json=True)
    ((endpoint,),) = [json.loads(line)["endpoints"] for line in said]
    assert re.fullmatch(r"tcp/127\.0\.0\.1:[1-9]\d*", endpoint)


async def test_a_router_that_answers_is_counted(capsys: pytest.CaptureFixture[str]) -> None:
    bus = await open_bus(BusConfig(mode="router", listen=("tcp/127.0.0.1:0",)))
    try:
        (endpoint,) = bus.endpoints
        await asyncio.to_thread(router, check=True, connect=endpoint, as_json=True)
        found = json.loads(capsys.readouterr().out)
        assert (found["endpoint"], len(found["routers"])) == (endpoint, 1)
        await asyncio.to_thread(router, check=True, connect=endpoint)
        assert capsys.readouterr() == ("", f"a router answers at {endpoint}\n")
    finally:
        await bus.close()


def test_a_router_with_tls_lets_the_agents_of_its_tasks_in_and_nobody_else() -> None:
    rules = access_rules([load_task("2s3z_pair"), load_task("2s3z")], "first")["access_control"]
    assert rules["default_permission"] == "deny"
    assert [subject["id"] for subject in rules["subjects"]] == [
        "host", "observer", "agent:blue/CombatGroupSmac", "agent:blue/Stalkers", "agent:blue/Zealots",
        "adviser:blue/Adviser",
    ]  # fmt: skip


def test_a_router_does_not_let_other_machines_in_without_being_told_to() -> None:
    with pytest.raises(BusError, match=r"^tcp/0\.0\.0\.0:0 would let every machine that reaches it join without TLS"):
        router(listen=["tcp/0.0.0.0:0"])


def test_a_replay_takes_what_a_view_takes(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for run, age_s in (("older", 60), ("newer", 0)):
        (tmp_path / "runs" / run).mkdir(parents=True)
        copy = tmp_path / "runs" / run / "recording.mcap"
        copy.write_bytes(recording.read_bytes())
        os.utime(copy, ns=(10**18 - age_s * 10**9,) * 2)
    newest, oldest = (f"runs/{run}/recording.mcap" for run in ("newer", "older"))
    for given, told in (
        ([], [newest]),
        (["older"], [oldest]),
        (["runs"], [newest]),
        ([oldest, newest], [oldest, newest]),
    ):
        replay([Path(name) for name in given], as_json=True)
        out, err = capsys.readouterr()
        assert err.splitlines() == told
        assert len(out.splitlines()) == len(told)
    with pytest.raises(ConfigError, match=r"^there is no last, nor runs/last: name a recording, a directory or a run$"):
        replay([Path("last")])
    with pytest.raises(ConfigError, match="the files of 2 recordings would be mixed: name one"):
        replay([Path(oldest), Path(newest)], images=tmp_path / "pictures")
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConfigError, match="there is no recording in empty"):
        replay([Path("empty")])
