"""The command line as a person meets it: a process, its words, its exit code."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from khala_protocol.messages import Report
from khala_protocol.recording import Recording
from khala_protocol.service import MatchCard
from khala_sc2.cli import main
from khala_sc2.commands.exit_codes import AFTER_SIGNAL, DONE, FAILED, NOT_VALID, WRONG_USAGE
from khala_sc2.service.commands import exit_code

KEY = "sk-test-0123456789abcdef-do-not-tell"


def khala(*arguments: str, cwd: Path, **environ: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "khala_sc2", *arguments],
        cwd=cwd,
        env=os.environ | {"KHALA_CACHE": str(cwd / "cache"), "COLUMNS": "200"} | environ,
        capture_output=True,
        text=True,
        timeout=110,
        check=False,
    )


BAD = [
    ("run nosuch", "there is no task 'nosuch'"),
    ("run 2s3zz", "did you mean 2s3z"),
    ("run", "give a task, such as 2s3z_pair (`khala tasks` lists them), or a recording with --resume"),
    ("run --resume missing", "there is no missing, and no runs/missing: give a run, its directory, or a .mcap file"),
    ("submit", "give a task, such as 2s3z_pair (`khala tasks` lists them), or a match with --resume"),
    pytest.param("matches --connect tcp/127.0.0.1:{closed}", "`khala serve` starts a service", marks=pytest.mark.slow),
    (
        "run bad.yaml",
        "bad.yaml:3 (agents.0.teams.0.unit_types.0): there is no unit type 'Stlaker', did you mean 'Stalker'?",
    ),
    ("run sections.yaml", "there is no section 'teamz' of an observation: did you mean 'teams'?"),
    ("run 2s3z --images foo", "there is no picture 'foo', there are screen, minimap"),
    ("actions --group foo", "there is no group 'foo', there are basic, build"),
    ("actions --unit Stlaker", "there is no unit type 'Stlaker', did you mean 'Stalker'?"),
    ("knowledge show Nothing", "nothing in version 4.10 of the game is called 'Nothing'"),
    ("run broken.yaml", "broken.yaml:2: this is not YAML"),
    ("run missing.yaml", "missing.yaml: there is no such file"),
    ("run 2s3z --run a/b", "run 'a/b' cannot stand in a key"),
    ("run 2s3z --executor magic", "executor: Input should be 'raw' or 'screen'"),
    ("run 2s3z --opponent guest", "the map 2s3z has no place for a player who joins"),
    (
        "run simple64_eceb_terran --opponent bob",
        "'bob' is not an opponent: give computer, guest, guest:COMMAND or lan:",
    ),
    (
        "run simple64_eceb_terran --opponent lan:10.0.0.5:9",
        "'10.0.0.5:9' is not 127.0.0.1:PORT: the game plays over LAN on",
    ),
    ("run simple64_eceb_terran --opponent lan --episodes 2", "a game over LAN is played once"),
    ("run 2s3z --model nope", "there is no model file 'nope'"),
    ("run 2s3z --model openai", "no key: set the environment variable OPENAI_API_KEY"),
    ("run 2s3z --policy nope:decide", "there is no module 'nope'"),
    ("run 2s3z --red openai", "the task has no side red: its only side is blue"),
    ("run duel_3m --side-model green=openai", "the task has no side green: its sides are blue and red"),
    ("run duel_3m --side-model openai", "--side-model: 'openai' does not name a side and its model: write red=openai"),
    ("run duel_3m --red nope/gpt", "there is no model file 'nope'"),
    ("run duel_3m --blue skilled --red nope:decide", "there is no module 'nope'"),
    ("run 2s3z --game nowhere", "there is no StarCraft II in nowhere"),
    ("run 2s3z --game starcraft2", "there is no StarCraft II in nowhere (SC2PATH)"),
    ("run 2s3z --out file/below", "cannot be made: Not a directory; --out names another place"),
    pytest.param("host 2s3z --connect tcp/127.0.0.1:{closed}", "nothing listens there", marks=pytest.mark.slow),
    ("host 2s3z --listen tcp/127.0.0.1:{taken}", "another process uses it"),
    ("host 2s3z --listen tcp/0.0.0.0:7499", "would let every machine that reaches it join without TLS"),
    ("host 2s3z --connect x --listen y", "give --connect or --listen, not both"),
    ("host 2s3z --connect tcp/10.0.0.5:7447", "would send everything to another machine without TLS"),
    ("host 2s3z --tls nowhere", "nowhere: no certificate of host, there are none: make it with `khala keys init DIR`"),
    ("router --tls nowhere", "with --tls only agents of a task may join: give --task TASK"),
    ("router --tls nowhere --task 2s3z", "nowhere: no certificate of router"),
    (
        "agent Stalkers --run r --tls nowhere --policy silent",
        "make it with `khala keys agent Stalkers DIR --side blue`",
    ),
    ("keys agent Stalkers nowhere", "nowhere: holds no authority: make one with `khala keys init DIR`"),
    ("advise r --tls nowhere", "make it with `khala keys adviser Adviser DIR --side blue`"),
    pytest.param(
        "advise r --connect tcp/127.0.0.1:{closed}", "the match is elsewhere, or over", marks=pytest.mark.slow
    ),
    ("advise r --name a/b", "name 'a/b' cannot stand in a key"),
    ("keys show nowhere", "nowhere: holds no certificates"),
    ("router --listen tcp/127.0.0.1:{taken}", "another process uses it"),
    ("router --check --connect tcp/127.0.0.1:{closed}", "no router answered"),
    pytest.param(  # 5 s
        "agent Stalkers --run r --connect tcp/127.0.0.1:{closed} --policy silent",
        "no router answered",
        marks=pytest.mark.slow,
    ),
    ("agent Stalkers --run r --connect nonsense --policy silent", "'nonsense' is not an endpoint"),
    ("llm --port {taken}", "in use"),
    ("llm --fault teapot=2", "teapot"),
    ("replay missing.mcap", "there is no missing.mcap, nor runs/missing.mcap"),
    ("replay bad.yaml", "bad.yaml is not a recording"),
    ("view nosuch", "there is no nosuch, nor runs/nosuch: name a recording, a directory or a run"),
    ("view --host 0.0.0.0", "give --password, or --https CERT KEY"),
    ("replay missing.mcap --steps soon", "'soon' does not name steps"),
    ("sc2 install file/below", "file"),
]


def test_the_table_of_exit_codes_has_all_of_them() -> None:
    page = Path(__file__).parents[2] / "docs" / "how-to" / "faults.md"
    rows = re.findall(r"^\| ([\d, ]+) \|", page.read_text(), re.MULTILINE)
    codes = [int(code) for row in rows for code in row.split(", ")]
    assert codes == [DONE, FAILED, WRONG_USAGE, NOT_VALID, *AFTER_SIGNAL]


@pytest.mark.parametrize(
    ("state", "reason", "code"), [("done", "", 0), ("done", "not valid: x", 3), ("failed", "x", 1), ("stopped", "", 1)]
)
def test_who_watches_a_match_ends_as_it_did(state: Any, reason: str, code: int) -> None:
    assert exit_code(MatchCard(run="r", number="1", task="t", state=state, reason=reason)) == code


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("cli")
    task = Path(__file__).parents[2] / "configs" / "tasks" / "llm_smac" / "2s3z.yaml"
    assert task.is_file()
    (place / "bad.yaml").write_text(
        "name: bad\nmap: 2s3z\nagents: [{name: A, role: r, teams: [{name: T, unit_types: [Stlaker]}], actions: {}}]\n"
        "task: win\n"
    )
    (place / "sections.yaml").write_text(
        "name: bad\nmap: 2s3z\nagents: [{name: A, role: r, sections: [game, teamz], teams: [{name: T, unit_types: "
        "[Stalker]}], actions: {Stalker: [Stop]}}]\ntask: win\n"
    )
    (place / "broken.yaml").write_text("name: x\n  map: [\n")
    (place / "file").write_text("")
    return place


@pytest.mark.parametrize(("command", "words"), BAD)
def test_what_the_user_can_mend_is_one_sentence_and_no_traceback(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str, words: str
) -> None:
    monkeypatch.chdir(place)
    monkeypatch.setenv("KHALA_CACHE", str(place / "cache"))
    monkeypatch.setenv("OPENAI_API_KEY", "")
    monkeypatch.setenv("SC2PATH", "nowhere")
    with socket.socket() as taken, socket.socket() as closed:
        for held in (taken, closed):
            held.bind(("127.0.0.1", 0))
        taken.listen()
        ports = {"taken": taken.getsockname()[1], "closed": closed.getsockname()[1]}
        with pytest.raises(SystemExit) as ended:
            main(command.format(**ports).split())
    told = capsys.readouterr()
    assert ended.value.code == 1, told.err
    assert words in told.err
    assert told.out == ""
    assert len(told.err.strip().splitlines()) == 1


NOWHERE = dict.fromkeys(["HTTP_PROXY", "http_proxy", "HTTPS_PROXY", "ALL_PROXY", "all_proxy"], "http://127.0.0.1:1")
"""An environment whose proxy never answers: neither the game nor a model on this machine may go through it."""


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """Return where four steps were played, by a model whose key is in the environment, and what was printed."""
    place = tmp_path_factory.mktemp("played")
    llm = [sys.executable, "-m", "khala_sc2", "llm", "--port", "0", "--latency", "0", "--json"]
    with subprocess.Popen(llm, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as endpoint:
        assert endpoint.stdout is not None
        base_url = json.loads(endpoint.stdout.readline())["base_url"]
        command = ["-v", "run", "2s3z_pair", "--model", "openai", "--model-name", "focus-fire"]
        command += ["--base-url", base_url, "--max-steps", "4", "--json"]
        done = khala(*command, cwd=place, OPENAI_API_KEY=KEY, **NOWHERE)
        endpoint.terminate()
    assert done.returncode == 0, done.stderr
    return place, done


@pytest.mark.game
@pytest.mark.slow
@pytest.mark.parametrize(("task", "proxy"), [("2s3z_pair", "nonsense://"), ("duel_3m", "socks5://127.0.0.1:1")])
def test_a_proxy_in_the_environment_changes_nothing_on_this_machine(task: str, proxy: str, tmp_path: Path) -> None:
    environ = dict.fromkeys(NOWHERE, proxy)
    done = khala("run", task, "--policy", "silent", "--max-steps", "3", "--json", cwd=tmp_path, **environ)
    assert done.returncode == 0, done.stderr
    assert {result["cause"] for result in json.loads(done.stdout)["results"]} == {"step limit"}


@pytest.mark.game
def test_a_match_prints_one_json_object_and_leaves_a_recording(
    played: tuple[Path, subprocess.CompletedProcess[str]],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    place, done = played
    told = json.loads(done.stdout)
    (result,) = told["results"]
    assert (result["steps"], result["outcome"], result["cause"]) == (4, "cut", "step limit")
    assert result["statuses"] == {"Stalkers": {"ok": 4}, "Zealots": {"ok": 4}}
    recording = Recording.open(place / told["recording"])
    assert recording.complete
    assert len(list(recording.of(Report))) == 4
    monkeypatch.chdir(place)
    code, replayed = tell(capsys, "replay", told["recording"], "--steps", "2")
    assert code == 0
    assert "step 2" in replayed
    assert "step 3" not in replayed


@pytest.mark.slow
@pytest.mark.game
def test_each_side_of_a_duel_plays_with_its_own_model_and_has_its_own_result(tmp_path: Path) -> None:
    sides = ("--blue", "scripted/skilled", "--red", "silent")
    done = khala("run", "duel_3m", *sides, "--max-steps", "25", "--latency", "0", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    blue, red = json.loads(done.stdout)["results"]
    assert [(result["side"], result["outcome"]) for result in (blue, red)] == [("blue", "win"), ("red", "loss")]
    assert blue["usage"]["Captain"]["requests"] == blue["steps"]
    assert red["usage"]["Captain"]["requests"] == 0
    assert "blue: win, enemy defeated" in done.stderr
    assert "red: loss, defeated" in done.stderr
    assert done.stderr.count("step 0, ") == 1


class Refusing(BaseHTTPRequestHandler):
    """A model endpoint that accepts no key."""

    def do_GET(self) -> None:
        self.send_response(401)
        self.end_headers()
        self.wfile.write(b'{"error": {"message": "Incorrect API key provided", "code": "invalid_api_key"}}')

    def log_message(self, *_: object) -> None:
        """Keep quiet."""


@pytest.mark.game
@pytest.mark.slow
def test_a_key_that_the_endpoint_refuses_ends_the_match_before_it_begins(tmp_path: Path) -> None:
    with ThreadingHTTPServer(("127.0.0.1", 0), Refusing) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        base_url = f"http://127.0.0.1:{server.server_port}/v1"
        done = khala("run", "2s3z", "--model", "openai", "--base-url", base_url, cwd=tmp_path, OPENAI_API_KEY=KEY)
        server.shutdown()
    assert done.returncode == 1
    assert "answered http 401: Incorrect API key provided; is the key right" in done.stderr
    assert "Traceback" not in done.stderr
    assert KEY not in done.stderr


DEADLY = """
import os, pathlib, signal

def decide(briefing, observation):
    killed = pathlib.Path("killed")
    if observation.agent == "Stalkers" and observation.step == 2 and (not killed.exists() or {always}):
        killed.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return ""
"""
PLAYED = ("run", "2s3z_pair", "--policy", "deadly:decide", "--max-steps", "5", "--max-wait", "20", "--json")


@pytest.mark.slow
@pytest.mark.game
def test_a_process_that_is_killed_is_started_again_and_no_step_is_lost(tmp_path: Path) -> None:
    (tmp_path / "deadly.py").write_text(DEADLY.format(always=False))
    done = khala(*PLAYED, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (result,) = json.loads(done.stdout)["results"]
    assert result["statuses"] == {"Stalkers": {"ok": 5}, "Zealots": {"ok": 5}}
    assert [text.partition(" was away for ")[0] for text in result["incidents"]] == [
        "step 2: required agent blue/Stalkers"
    ]


@pytest.mark.game
@pytest.mark.slow
def test_a_process_that_dies_again_and_again_ends_the_match(tmp_path: Path) -> None:
    (tmp_path / "deadly.py").write_text(DEADLY.format(always=True))
    done = khala(*PLAYED, cwd=tmp_path)
    assert done.returncode == 1
    assert "agents-0" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.game
def test_an_agent_that_cannot_begin_ends_the_match_with_its_own_words(tmp_path: Path) -> None:
    (tmp_path / "picky.py").write_text(
        "import sys\nif 'agent' in sys.argv: raise OSError('no GPU here')\ndef decide(b, o):\n    return ''\n"
    )
    done = khala("run", "2s3z", "--policy", "picky:decide", cwd=tmp_path)
    assert done.returncode == 1
    assert "no GPU here" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.game
@pytest.mark.parametrize(
    ("sent", "code"), [(signal.SIGINT, 130), pytest.param(signal.SIGTERM, 143, marks=pytest.mark.slow)]
)
def test_a_signal_ends_everything_and_leaves_a_readable_recording(
    tmp_path: Path, sent: signal.Signals, code: int
) -> None:
    command = [sys.executable, "-m", "khala_sc2", "run", "2s3z", "--latency", "0.05", "--run", "cut"]
    environ = os.environ | {"KHALA_CACHE": str(tmp_path / "cache")}
    with subprocess.Popen(command, cwd=tmp_path, env=environ, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith("step 0"):
                break
        process.send_signal(sent)
        rest = process.stderr.read()
        assert process.wait(30) == code
    assert "interrupted" in rest
    assert "Traceback" not in rest
    recording = tmp_path / "runs" / "cut" / "recording.mcap"
    assert list(Recording.open(recording).of(Report))
    assert [path.stat().st_mode & 0o777 for path in (recording, recording.parent)] == [0o600, 0o700]
    assert _processes_of("cut") == []


def _processes_of(run: str) -> list[str]:
    """Return the command lines of processes that still play this run."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = entry.read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if "--run" in words and words[words.index("--run") + 1] == run:
            found.append(" ".join(words))
    return found


@pytest.mark.game
def test_a_key_in_the_environment_is_in_nothing_that_a_run_leaves_behind(
    played: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    place, done = played
    recording = place / json.loads(done.stdout)["recording"]
    leftovers = [done.stdout, done.stderr, *(sample.payload.decode() for sample in Recording.open(recording))]
    leftovers += [path.read_text() for path in recording.parent.glob("*.log")]
    assert len(leftovers) > 10
    assert not [text for text in leftovers if KEY in text]
    assert KEY.encode() not in recording.read_bytes()


@pytest.mark.slow
def test_an_error_of_a_real_process_is_one_sentence_as_well(tmp_path: Path) -> None:
    done = khala("run", "nosuch", cwd=tmp_path)
    assert done.returncode == 1
    assert done.stderr.startswith("khala: there is no task 'nosuch'")
    assert "Traceback" not in done.stderr


def tell(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    return int(ended.value.code or 0), capsys.readouterr().out


def test_stubs_that_pip_has_overwritten_are_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def old_stubs(*_: object, **__: object) -> None:
        raise TypeError("Descriptors cannot be created directly.\nIf this call came from a _pb2.py file, ...")

    monkeypatch.setattr("khala_sc2.cli.app", old_stubs)
    with pytest.raises(SystemExit) as ended:
        main(["tasks"])
    assert str(ended.value).endswith("pip install --force-reinstall --no-deps pys2clientprotocol")
    assert not capsys.readouterr().out


def test_the_doctor_says_what_it_finds_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    _, out = tell(capsys, "doctor", "--json")
    found = {finding["name"]: finding["state"] for finding in json.loads(out)["findings"]}
    assert found["Python"] == found["PySC2"] == found["protobuf"] == "ok"


def test_the_doctor_says_what_to_do_about_a_wrong_sc2path(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("SC2PATH", str(tmp_path))
    code, out = tell(capsys, "doctor", "--json")
    (wrong,) = [finding for finding in json.loads(out)["findings"] if finding["state"] == "wrong"]
    assert code == 1
    assert "khala sc2 install" in wrong["advice"]


def test_the_doctor_says_which_endpoint_goes_through_which_proxy_and_what_is_trusted(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("http_proxy", "https_proxy", "all_proxy", "no_proxy", "HTTP_PROXY", "HTTPS_PROXY", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)
    for name in ("SSL_CERT_FILE", "SSL_CERT_DIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ALL_PROXY", "http://me:hidden@proxy.example:3128")
    monkeypatch.setenv("NO_PROXY", "api.deepseek.com")
    monkeypatch.setenv("VLLM_BASE_URL", "http://gpu.example:8000/v1")
    monkeypatch.setenv("REQUESTS_CA_BUNDLE", str(tmp_path))
    _, out = tell(capsys, "doctor", "--json")
    found = {finding["name"]: finding["found"] for finding in json.loads(out)["findings"]}
    proxy, _, away = found["proxy"].partition(" for ")
    assert proxy == "http://proxy.example:3128 (ALL_PROXY)"
    assert {"anthropic", "azure", "gemini", "gpt-4o", "openai", "vllm"} <= set(away.split(", "))
    assert found["no proxy"] == "for deepseek, llamacpp, lmstudio, ollama, scripted"
    assert found["trusted certificates"] == f"REQUESTS_CA_BUNDLE={tmp_path}"
    assert "hidden" not in out
    monkeypatch.setenv("ALL_PROXY", "socks4://proxy.example:1080")
    monkeypatch.setenv("REQUESTS_CA_BUNDLE", str(tmp_path / "none"))
    _, out = tell(capsys, "doctor", "--json")
    notes = {finding["name"]: finding for finding in json.loads(out)["findings"] if finding["state"] == "note"}
    assert "a proxy of the kind 'socks4' cannot be used" in notes["proxy for openai"]["found"]
    assert "there is no file or directory" in notes["trusted certificates"]["found"]


def test_the_doctor_says_what_a_game_needs_that_is_not_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    code, out = tell(capsys, "doctor", "--game", str(tmp_path), "--json")
    found = {finding["name"]: finding for finding in json.loads(out)["findings"]}
    assert code == 1
    assert "game" not in found  # such as the simulator, which nobody asked about
    assert "no directory Versions" in found["game process"]["found"]
    assert "real-game.md" in found["game process"]["advice"]


@pytest.mark.slow
@pytest.mark.game
def test_the_doctor_starts_a_game_and_tries_its_maps(capsys: pytest.CaptureFixture[str]) -> None:
    _, out = tell(capsys, "doctor", "--game", "simulator", "--json")
    found = {finding["name"]: finding for finding in json.loads(out)["findings"]}
    assert "build 75689" in found["game process"]["found"]
    assert found["maps that load"]["state"] == found["rendering"]["state"] == "ok"
    assert [name for name in found if name.startswith("map ")] == []


def test_keys_are_made_shown_and_examined(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    keys = str(tmp_path / "keys")
    agent, adviser = ["agent", "Stalkers", keys, "--days", "7"], ["adviser", "Ada", keys, "--side", "red"]
    for made in (["init", keys, "--host", "10.0.0.5"], agent, adviser):
        assert tell(capsys, "keys", *made)[0] == 0
    _, out = tell(capsys, "keys", "show", keys, "--json")
    rows = json.loads(out)["certificates"]
    shown = {row["name"]: (row["days_left"], row["hosts"]) for row in rows}
    assert shown["agent:blue/Stalkers"] == (7, [])
    assert shown["adviser:red/Ada"] == (365, [])
    assert shown["router"] == (365, ["10.0.0.5"])
    (tmp_path / "keys" / "host" / "key.pem").chmod(0o644)
    _, out = tell(capsys, "doctor", "--tls", keys, "--json")
    found = {finding["name"]: finding for finding in json.loads(out)["findings"]}
    assert found["certificate router"]["state"] == "ok"
    assert "`khala keys agent Stalkers DIR --side blue`" in found["certificate agent:blue/Stalkers"]["advice"]
    assert found["certificate host"]["advice"].startswith("chmod 600 ")


def test_keys_that_are_made_again_say_what_they_replace(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for _ in range(2):
        with pytest.raises(SystemExit):
            main(["keys", "init", str(tmp_path), "--host", "10.0.0.5", "--days", "7"])
    once, again = (said.splitlines() for said in capsys.readouterr().err.split(f"made {tmp_path}/host\n", 1))
    assert once == [f"made {tmp_path}/router, which listens at 10.0.0.5"]
    assert [line.partition("; ")[2].rpartition(" ")[0] for line in again] == [
        "copies of the one before are good until"
    ] * 2


def test_every_task_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    _, out = tell(capsys, "tasks", "--json")
    names = {task["name"] for task in json.loads(out)["tasks"]}
    assert {"2s3z", "2s3z_pair", "3s5z", "1c3s5z", "3s5z_vs_3s6z", "2c_vs_64zg", "2s_vs_1sc"} <= names


@pytest.mark.parametrize(
    "command", ["", "run", "host", "agent", "router", "keys", "llm", "replay", "doctor", "tasks", "sc2"]
)
def test_help_teaches(capsys: pytest.CaptureFixture[str], command: str) -> None:
    code, out = tell(capsys, *command.split(), "--help")
    assert code == 0
    assert "Usage: khala" in out
    if command in {"run", "host", "agent", "router", "llm", "replay"}:
        assert "Examples:" in out
