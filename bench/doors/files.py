"""Files that somebody made or damaged, full disks, words that would act on a terminal, and floods of orders."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import io
import json
import os
import shutil
import sqlite3
import stat
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self
from unittest import mock

from bench.doors.rows import Row, Skipped
from bench.paths import ROOT
from khala_agents.policy import FunctionPolicy
from khala_agents.worker import run_worker
from khala_bridge.game.game import GameIdentity
from khala_orchestrator.commands import replay
from khala_orchestrator.config import MatchConfig, load_task
from khala_orchestrator.console import Progress, stdout_console
from khala_orchestrator.match.cards import run_card
from khala_orchestrator.publish.record import Listener, RecordingBus
from khala_orchestrator.roster import Seat
from khala_protocol.bus import Delivery
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.codec import encode
from khala_protocol.commandline import run_command
from khala_protocol.files import write_private
from khala_protocol.keys import Topic, agent_key, every_agent, run_key
from khala_protocol.messages import (
    AgentReport,
    Briefing,
    Casualties,
    ChatMessage,
    Clock,
    ModelCall,
    Observation,
    Reply,
    Report,
    Result,
    View,
)
from khala_protocol.recording import Recorder, Recording
from khala_protocol.service import MatchCard, Matches, Submit
from khala_sc2.arena import commands as arena
from khala_sc2.dataset.card import Recipe
from khala_sc2.dataset.choose import RowChoice, Split
from khala_sc2.dataset.export import export
from khala_sc2.dataset.files import RowForm
from khala_sc2.experiment import commands, results
from khala_sc2.experiment.store import INDEX, MATCHES, Store
from khala_sc2.playing.matches import new, newest_recording
from khala_sc2.playing.minds import Minds
from khala_sc2.service import client
from khala_sc2.service import commands as service_commands
from khala_sc2.service.book import Book, Limits
from khala_sc2.view.runs import Opened
from khala_sc2.view.scan import whole

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

EVIL: Final = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202e[red][link=http://e]"
"""A title, an empty screen, a colour, letters from right to left, and markup."""
AGENT = "Stalkers"
GAME = GameIdentity("4.10", "B0", "Map.SC2Map", "0" * 64)
FILE = "name: e\nfixed: {model: scripted}\nfactors: {task: [2s3z_pair]}\nseeds: 2\n"


# --- what is attacked -----------------------------------------------------------------------------------


def _write_recording(
    path: Path, labels: Mapping[str, str], *, seed: int = 1, finished: bool = True, words: str = ""
) -> None:
    """Write the recording of a match of one step."""
    config = MatchConfig(task=load_task("2s3z_pair"), run="e", seed=seed, labels=dict(labels))
    where: dict[str, Any] = {"run": "e", "side": "blue", "episode": 0}
    call = ModelCall(
        **where, agent=AGENT, step=0, attempt=1, model=f"m{words}", endpoint="http://e",
        prompt=(ChatMessage(role="user", content="go"),), completion="<Stop()>", status="ok", started_s=0, latency_s=0,
    )  # fmt: skip
    report = Report(
        **where, step=0, game_loop=8, agents=(AgentReport(agent=AGENT, side="blue", status="ok", detail=words),)
    )
    seen = Observation(**where, agent=AGENT, step=0, game_loop=8, answer_within_s=1, text=words, view=View(time_s=0.0))
    ended = Result(
        **where, outcome="win", cause="enemy defeated", steps=1, game_loop=8, game_s=0.4, wall_s=2.0,
        killed=Casualties(units=1, value=100.0), lost=Casualties(units=1, value=100.0), kd=1.0,
    )  # fmt: skip
    with Recorder(path) as recorder:
        recorder.write(run_key("e", Topic.RUN), encode(run_card(config, GAME)))
        told = Briefing(**where, agent=AGENT, role="", task="", teams=(), actions=(), clock=Clock())
        recorder.write(agent_key("e", "blue", AGENT, Topic.BRIEFING), encode(told))
        recorder.write(agent_key("e", "blue", AGENT, Topic.OBSERVATION), encode(seen))
        recorder.write(agent_key("e", "blue", AGENT, Topic.EXCHANGE), encode(call))
        said = Reply(**where, agent=AGENT, step=0, text="<Stop()>", attempts=1)
        recorder.write(agent_key("e", "blue", AGENT, Topic.REPLY), encode(said))
        recorder.write(run_key("e", Topic.REPORT), encode(report))
        if finished:
            recorder.write(run_key("e", Topic.RESULT), encode(ended))


def _experiment(directory: Path, *, words: str = "") -> Store:
    """Return an experiment of which two matches were played."""
    store = Store(directory / "e")
    write_private(directory / "e.yaml", FILE)
    store.begin(directory / "e.yaml")
    store.adopt()
    for seed in (1, 2):
        path = store.recording_for(f"m{seed}")
        _write_recording(path, {"match": f"m{seed}", "factor.task": f"2s3z_pair{words}"}, seed=seed, words=words)
        store.take(path, attempts=1)
    return store


def capture(command: Callable[[], object]) -> tuple[str, str]:
    """Return what a command prints, and how it got through if it did not end in a sentence or well."""
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
        try:
            run_command("khala", command)
        except SystemExit as ended:
            if ended.code != 1:
                return "", f"it ended with {ended.code}"
        except BaseException as error:  # noqa: BLE001  # whatever it is would be a traceback
            return "", f"a traceback: {type(error).__name__}: {error}"
    return out.getvalue() + err.getvalue(), ""


def _acts(text: str) -> str:
    """Return what of a printed text acts on a terminal, in words."""
    bad = [repr(character) for character in text if not (character.isprintable() or character in "\n\t")]
    return f"{bad[0]} reached the terminal" if bad else ""


def _report(store: Store) -> None:
    where = store.directory
    results.report(where, formats="all", into=where / "report", by="", out=where.parent, as_json=False)


def _export(store: Store) -> None:
    results.export(store.directory, parquet=None, csv=store.directory / "x.csv", out=store.directory.parent)


# --- indexes --------------------------------------------------------------------------------------------


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _random(path: Path) -> None:
    path.write_bytes(os.urandom(path.stat().st_size))


def _bad_page(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[:4096] + os.urandom(len(data) - 4096))


def _directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


def _pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def _sql(script: str) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        with contextlib.closing(sqlite3.connect(path)) as db:
            db.executescript(script)

    return apply


async def _broken_index(damage: Callable[[Path], object], directory: Path) -> str:
    store = _experiment(directory)
    before = sorted(map(repr, store.results()))
    damage(store.directory / INDEX)
    fresh = Store(store.directory)
    _, traceback = capture(lambda: _export(fresh))
    if traceback:
        return traceback
    return "" if sorted(map(repr, fresh.results())) == before else "results were lost"


async def _late_copy(directory: Path) -> str:
    store = _experiment(directory)
    path = store.recording_for("m1")
    _write_recording(path, {"match": "m1"}, finished=False)
    os.utime(path.with_name("recording.mcap"), (0, 0))
    store.rebuild()
    return "" if store.matches()["m1"].state == "done" else "a crashed try hides a done match"


async def _old_time(directory: Path) -> str:
    for number in range(11, 0, -1):
        name = "recording.mcap" if number == 1 else f"recording-{number}.mcap"
        _write_recording(directory / "run" / name, {"try": str(number)})
        os.utime(directory / "run" / name, (2000 - number, 2000 - number))
    card = newest_recording(directory / "run").run
    return "" if card and card.labels["try"] == "11" else "an older try is resumed"


async def _forged_view(directory: Path) -> str:
    path = directory / "a.mcap"
    _write_recording(path, {})
    forged = path.with_name(f".{path.name}.index")
    with mock.patch.dict(os.environ, {"KHALA_CACHE": str(directory / "cache")}):
        index = Opened("x", path).index
        whole(index)
        index.close()
        shutil.move(index.path, forged)
        _sql("delete from sample; delete from step")(forged)
        index = Opened("x", path).index
        whole(index)
        ((count,),) = index.rows("select count(*) from sample")
        index.close()
    return "" if count else "an index beside the recording is believed"


# --- disks ----------------------------------------------------------------------------------------------


class FullFile:
    """A file of a disk that is full after some bytes."""

    def __init__(self, file: Any, most: int) -> None:
        self._file, self._left = file, most

    def write(self, data: bytes) -> int:
        self._left -= len(data)
        if self._left < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return int(self._file.write(data))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


async def _full_disk(work: Callable[[Store], object], directory: Path) -> str:
    """Play a command on a disk on which no file gets longer than 100 bytes; what was there must stay."""
    store = _experiment(directory)
    capture(lambda: work(store))
    before = _contents(directory)
    fdopen = os.fdopen
    with mock.patch("os.fdopen", lambda *given: FullFile(fdopen(*given), 100)):
        said, traceback = capture(lambda: work(store))
    if traceback:
        return traceback
    if "No space left" not in said:
        return f"it says {said!r}"
    return (
        ""
        if _contents(directory) == before
        else f"{_contents(directory).keys() ^ before.keys() or 'a file'} is lost or half"
    )


def _contents(directory: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in directory.rglob("*") if path.is_file() and path.name != ".lock"}


async def _tiny_disk(directory: Path) -> str:
    """Make the index of an experiment anew on a disk of its own size."""
    if os.geteuid() != 0:
        raise Skipped("only root may make a disk of its own size")
    disk = directory / "disk"
    disk.mkdir()
    mounting = await asyncio.create_subprocess_exec("mount", "-t", "tmpfs", "-o", "size=900k", "tmpfs", str(disk))
    if await mounting.wait():
        raise Skipped("root may not mount a disk here")
    try:
        store = _experiment(disk)
        store.rebuild()
        with contextlib.suppress(OSError), (disk / "filler").open("wb") as filler:
            while True:
                filler.write(bytes(4096))
                filler.flush()
        before = sorted(map(repr, Store(store.directory).results()))
        for work in (
            partial(commands.index, store.directory, out=disk),
            lambda: _report(store),
            lambda: _export(store),
        ):
            said, traceback = capture(work)
            if traceback or "No space left" not in said:
                return traceback or f"it says {said!r}"
        found = sorted(map(repr, Store(store.directory).results()))
        halves = list(disk.rglob(".part-*"))
        return "" if found == before and not halves else "something was lost, or is half"
    finally:
        ending = await asyncio.create_subprocess_exec("umount", "--lazy", str(disk))
        await ending.wait()


async def _half_data_set(directory: Path) -> str:
    _write_recording(directory / "a.mcap", {})
    with mock.patch("json.dumps", side_effect=OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))):
        said, traceback = capture(partial(_data_set, directory))
    left = _contents(directory).keys() - {str(directory / "a.mcap")}
    return traceback or (f"{left} is left, and it says {said!r}" if left or "nothing of it is kept" not in said else "")


def _data_set(directory: Path) -> None:
    recipe = Recipe((RowForm.OPENAI,), RowChoice(), Split.of("1", "seed"), 1.0, False)
    export([directory / "a.mcap"], directory / "set", recipe)


async def _modes(directory: Path) -> str:
    umask = os.umask(0o022)
    try:
        store = _experiment(directory)
        capture(lambda: _report(store))
        capture(lambda: _export(store))
        _write_recording(directory / "a.mcap", {})
        capture(partial(_data_set, directory))
        with mock.patch.dict(os.environ, {"KHALA_CACHE": str(directory / "cache")}):
            index = Opened("x", directory / "a.mcap").index
            whole(index)
            index.close()
    finally:
        os.umask(umask)
    return _open_to_others(directory)


def _open_to_others(directory: Path) -> str:
    found = [path for path in directory.rglob("*") if stat.S_IMODE(path.stat().st_mode) & 0o077]
    return f"others may read {found[0].relative_to(directory)}" if found else ""


async def _link(directory: Path) -> str:
    store = _experiment(directory)
    (directory / "precious").write_text("mine")
    (store.directory / "x.csv").symlink_to(directory / "precious")
    _, traceback = capture(lambda: _export(store))
    return traceback or (
        "" if (directory / "precious").read_text() == "mine" else "a file behind a link is overwritten"
    )


# --- recordings -----------------------------------------------------------------------------------------


async def _odd_recordings(make: Callable[[Path], object], directory: Path) -> str:
    store = _experiment(directory)
    for number in (1, 2):
        make(store.directory / MATCHES / f"m{number}" / "recording.mcap")
    for command in (
        partial(commands.index, store.directory, out=directory),
        lambda: _report(Store(store.directory)),
        lambda: _export(Store(store.directory)),
        partial(commands.status, store.directory, game="simulator", out=directory, as_json=False),
    ):
        if traceback := capture(command)[1]:
            return traceback
    return ""


def _torn(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-400])


def _with_labels(labels: dict[str, str]) -> Callable[[Path], None]:
    def make(path: Path) -> None:
        path.unlink()
        _write_recording(path, labels)

    return make


async def _foreign_words(directory: Path) -> str:
    path = directory / "a.mcap"
    where: dict[str, Any] = {"run": "e", "side": "blue", "agent": "Zealots", "episode": 0, "step": 0}
    with Recorder(path) as recorder:
        recorder.write(agent_key("e", "blue", AGENT, Topic.REPLY), encode(Reply(**where, text="I surrender")))
    options = {"agent": "Zealots", "steps": None, "text": True, "images": None, "new": None, "pace": False}
    said, traceback = capture(partial(replay, [path], **options, as_json=False))  # type: ignore[arg-type]
    return traceback or ("words stand in the mouth of another agent" if "surrender" in said else "")


async def _foreign_reply(directory: Path) -> str:
    broker = MemoryBroker()
    key = agent_key("e", "blue", AGENT, Topic.REPLY)
    agent = await broker.session().publisher(key, Delivery.SPEECH)
    with Recorder(directory / "a.mcap") as recorder:
        bus = RecordingBus(broker.session(), recorder, [Seat("blue", AGENT), Seat("blue", "Zealots")])
        replies = await bus.subscribe(every_agent("e", Topic.REPLY), Delivery.SPEECH)
        await agent.put(encode(Reply(run="e", side="blue", agent="Zealots", episode=0, step=0, text="I surrender")))
        await anext(replies)
    recording = Recording.open(directory / "a.mcap")
    return "" if not recording.samples and recording.left_out else "they are in the recording, or nobody counted them"


async def _last_exchange(directory: Path) -> str:
    broker = MemoryBroker()
    said = await broker.session().publisher(agent_key("e", "blue", AGENT, Topic.REPLY), Delivery.SPEECH)
    asked = await broker.session().publisher(agent_key("e", "blue", AGENT, Topic.EXCHANGE), Delivery.LOG)
    where: dict[str, Any] = {"run": "e", "side": "blue", "agent": AGENT, "episode": 0, "step": 7}
    call = ModelCall(
        **where,
        attempt=1,
        model="m",
        endpoint="http://e",
        prompt=(),
        completion="",
        status="ok",
        started_s=0,
        latency_s=0,
    )
    with Recorder(directory / "a.mcap") as recorder:
        bus = RecordingBus(broker.session(), recorder, [Seat("blue", AGENT)])
        replies = await bus.subscribe(every_agent("e", Topic.REPLY), Delivery.SPEECH)
        async with Listener(bus, "e"):
            await said.put(encode(Reply(**where, text="", attempts=1)))
            await anext(replies)
            asyncio.get_running_loop().call_later(0.02, lambda: asyncio.ensure_future(asked.put(encode(call))))
    return (
        "" if list(Recording.open(directory / "a.mcap").of(ModelCall)) else "the exchange of the last step is missing"
    )


async def _broken_view(_: Path) -> str:
    broker = MemoryBroker()
    stop = asyncio.Event()
    host = broker.session()
    where = {"run": "e", "side": "blue", "agent": AGENT}
    replies = await host.subscribe(every_agent("e", Topic.REPLY), Delivery.SPEECH)
    briefings, observations = [
        await host.publisher(agent_key("e", "blue", AGENT, topic), Delivery.STATE)
        for topic in (Topic.BRIEFING, Topic.OBSERVATION)
    ]

    async def look(_: Briefing, seen: Observation) -> str:
        return f"{len(seen.view.teams)} teams"

    playing = asyncio.create_task(run_worker(broker.session(), "e", "blue", AGENT, FunctionPolicy(look), stop=stop))
    try:
        async with asyncio.timeout(5):
            told: dict[str, Any] = {"episode": 0, "role": "", "task": "", "teams": (), "actions": (), "clock": Clock()}
            await briefings.put(encode(Briefing(**where, **told)))
            for step, view in enumerate([{"teams": 7}, {"time_s": 0.0}]):
                seen = where | {"kind": "observation", "v": 1, "episode": 0, "step": step, "game_loop": 8, "text": ""}
                await observations.put(json.dumps(seen | {"answer_within_s": 5, "view": view}).encode())
                await anext(replies)
    except (TimeoutError, StopAsyncIteration):
        return "the agent is gone"
    finally:
        stop.set()
        ended = await asyncio.gather(playing, return_exceptions=True)
    return f"the agent ended with {ended[0]!r}" if isinstance(ended[0], BaseException) else ""


# --- terminals ------------------------------------------------------------------------------------------


async def _printing(command: Callable[[Path], object], directory: Path) -> str:
    said, traceback = capture(partial(command, directory))
    return traceback or _acts(said) or ("" if "owned" in said else f"it printed none of the words: {said!r}")


def _status(directory: Path, *, shows: bool) -> None:
    _experiment(directory, words="")
    text = FILE.replace("e\nfixed", f"{json.dumps('e')}\ndescription: {json.dumps(EVIL)}\nfixed")
    text = text.replace("[2s3z_pair]", f"[{{name: {json.dumps(EVIL)}, task: 2s3z_pair}}]")
    (directory / "e" / "experiment.yaml").write_text(text)
    if shows:
        commands.show(str(directory / "e" / "experiment.yaml"), game="simulator", out=directory, as_json=False)
    else:
        commands.status(directory / "e", game="simulator", out=directory, as_json=False)


def _list(_: Path) -> None:
    card = MatchCard(run="a", number="1", owner=EVIL, task=EVIL, state="failed", reason=EVIL)
    with mock.patch.object(service_commands, "ask", return_value=Matches(matches=(card,))):
        service_commands.matches(None, tls=None, insecure=False, as_json=False)


def _end(_: Path) -> None:
    card = MatchCard(run="a", number="1", owner=EVIL, task=EVIL, state="failed", reason=EVIL)
    service_commands.end(card, as_json=False)


def _watch(_: Path) -> None:
    report = Report(
        run="e",
        episode=0,
        step=0,
        game_loop=8,
        agents=(AgentReport(agent=AGENT, side="blue", status="ok", detail=EVIL),),
    )
    ended = Result(
        run="e", episode=0, outcome="loss", cause=EVIL, steps=1, game_loop=8, game_s=0.4, wall_s=2.0,
        killed=Casualties(), lost=Casualties(), kd=None, valid=False, invalid_because=EVIL,
    )  # fmt: skip
    with Progress(stdout_console()) as progress:
        progress(report)
        progress(ended)


def _replay(directory: Path) -> None:
    _write_recording(directory / "a.mcap", {}, words=EVIL)
    options: dict[str, Any] = {"agent": None, "steps": None, "text": True, "images": None, "new": None, "pace": False}
    replay([directory / "a.mcap"], **options, as_json=False)


def _compare(directory: Path) -> None:
    store = _experiment(directory, words=EVIL)
    results.compare(
        *[f"{store.directory}:task=2s3z_pair{EVIL}"] * 2, allow=(), measures=["win"], out=directory, as_json=False
    )


def _arena(directory: Path) -> None:
    """Show the results of an arena whose player has such a name."""
    shipped = (ROOT / "results" / "first.json").read_text(encoding="utf-8")
    name = json.dumps(EVIL)[1:-1]
    (directory / "results.json").write_text(shipped.replace("focus-fire", f"focus{name}"), encoding="utf-8")
    arena.show([directory / "results.json"], as_json=False)


def _missing_file(directory: Path) -> None:
    Recording.open(directory / EVIL)


# --- orders ---------------------------------------------------------------------------------------------


def _order(run: str, owner: str) -> Submit:
    return Submit(run=run, number=client.new_number(), owner=owner, minds=asdict(Minds()))


async def _flood(_: Path) -> str:
    config = new("2s3z_pair", "a", Path("nowhere"), seed=1, episodes=1, assemble_s=60.0)
    book = Book(Limits(matches=1))

    def submit(run: str, owner: str) -> bool:
        if book.why_not(run, owner):
            return False
        book.add(_order(run, owner), config, {})
        return True

    submit("first", "ann")
    if (entry := book.next(0)) is not None:
        book.begin(entry)
    for number in range(400):
        submit(f"flood-{number}", f"owner-{number}")
    if not submit("second", "ann"):
        return "an owner who was here before finds no place"
    book.close_match(book.of("running")[0], "done")
    turns = []
    for _number in range(2):
        if (entry := book.next(0)) is not None:
            book.begin(entry)
            turns.append(entry.card.owner)
            book.close_match(entry, "done")
    return "" if "ann" in turns else f"the turns were those of {turns}"


DAMAGES: Final[dict[str, Callable[[Path], object]]] = {
    "torn": _cut,
    "random bytes": _random,
    "damaged in its pages": _bad_page,
    "a directory": _directory,
    "a pipe": _pipe,
    "missing": Path.unlink,
    "of another version": _sql("pragma user_version = 99"),
    "of a foreign table": _sql("drop table calls; create view calls as select 1"),
    "wrong in a row": _sql("update results set steps = 'many'; update matches set cell = '{'"),
}
ODD: Final[dict[str, Callable[[Path], object]]] = {
    "are torn": _torn,
    "are empty": lambda path: path.write_bytes(b""),
    "are none": lambda path: path.write_bytes(b"MZ" * 999),
    "have no labels": _with_labels({}),
    "have labels of somebody else": _with_labels({"repetition": "many", "match": EVIL, f"factor.{EVIL}": EVIL}),
}
PRINTING: Final[dict[str, Callable[[Path], object]]] = {
    "experiment show": partial(_status, shows=True),
    "experiment status": partial(_status, shows=False),
    "experiment compare": _compare,
    "arena show": _arena,
    "matches": _list,
    "stop": _end,
    "watch": _watch,
    "replay": _replay,
    "replay (a name of a file)": _missing_file,
}
ROWS: Final[tuple[Row, ...]] = (
    *(
        Row("khala experiment export", f"an index that is {what}", partial(_broken_index, damage), "fault")
        for what, damage in DAMAGES.items()
    ),
    Row("khala experiment index", "a crashed try that was copied last", _late_copy, "fault"),
    Row("khala run --resume", "tries whose times of change are the wrong way round", _old_time, "fault"),
    Row("khala view", "a forged index beside a recording", _forged_view),
    Row("khala experiment export", "a disk that fills up", partial(_full_disk, _export), "fault"),
    Row("khala experiment report", "a disk that fills up", partial(_full_disk, _report), "fault"),
    Row("khala experiment", "a disk of 900 kB", _tiny_disk, "fault"),
    Row("khala dataset export", "a disk that fills up", _half_data_set, "fault"),
    Row("files", "another user who reads what commands wrote", _modes),
    Row("khala experiment export", "a link where the file is to be", _link),
    *(
        Row("khala experiment", f"recordings that {what}", partial(_odd_recordings, make), "quirk")
        for what, make in ODD.items()
    ),
    Row("khala replay", "a reply that names another agent than its key", _foreign_words),
    Row("recording", "an agent that puts words into another's mouth", _foreign_reply),
    Row("recording", "an exchange that arrives after the last report", _last_exchange, "fault"),
    Row("khala agent", "an observation with a malformed view", _broken_view),
    *(
        Row(f"khala {door}", "escape sequences and markup", partial(_printing, command))
        for door, command in PRINTING.items()
    ),
    Row("khala serve", "400 orders under 400 names", _flood),
)
