"""Doors of the smaller commands: advisers, calibrations, the doctor, keys, facts, the scripted model and the router."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import json
import os
import random
import socket
import ssl
import sys
from base64 import b64decode, b64encode
from contextlib import asynccontextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, Final
from unittest import mock

import aiohttp
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.x509.oid import NameOID

from bench.doors.files import EVIL, GAME, FullFile, capture
from bench.doors.rows import Row
from bench.paths import GOLDEN
from khala_agents.scripted.canned import Canned, Given, completion, refusal
from khala_agents.scripted.endpoint import Endpoint
from khala_bridge.calibrate.record import Calibration, Measured, Values
from khala_orchestrator.commands import access_rules
from khala_orchestrator.config import MatchConfig, load_task
from khala_orchestrator.match.cards import run_card
from khala_protocol.bus import Delivery
from khala_protocol.bus.certificate import read
from khala_protocol.bus.config import BusConfig, TlsFiles, host_port_of
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.bus.zenoh import ZenohBus, open_bus
from khala_protocol.certificates import certify_agent, files_of, make_authority
from khala_protocol.codec import encode
from khala_protocol.errors import BusError, ConfigError
from khala_protocol.keys import Topic, agent_key, host_key, run_key
from khala_protocol.messages import AgentReport, Casualties, Received, Report, Result
from khala_protocol.visible import visible
from khala_sc2.calibrate import commands as calibrating
from khala_sc2.commands.advise import Adviser, Advising, lines_about
from khala_sc2.knowledge import cli as knowledge
from khala_sc2.knowledge import files as facts

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Coroutine, Iterator, Mapping
    from pathlib import Path

    from khala_protocol.messages import Run

    Play = Callable[[Path], Coroutine[Any, Any, str]]

PATIENCE_S: Final = 20.0


# --- what a command says --------------------------------------------------------------------------------


async def _said(*words: str, **environ: str) -> tuple[int, str]:
    """Run a command of `khala`; return its exit code and what it said, or that it said nothing for too long."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-P", "-m", "khala_sc2", *words, env={**os.environ, "COLUMNS": "400", **environ},
        stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT,
    )  # fmt: skip
    try:
        said, _ = await asyncio.wait_for(process.communicate(), PATIENCE_S)
    except TimeoutError:
        process.kill()
        await process.wait()
        return -1, f"it did not end within {PATIENCE_S:g} s"
    return process.returncode or 0, said.decode(errors="backslashreplace")


def _fault(code: int, said: str, codes: tuple[int, ...], *words: str) -> str:
    """Return how a command got through: another exit code, a traceback, an escape sequence, or a missing word."""
    if code not in codes or "Traceback" in said:
        return f"exit code {code}: {said[-300:]}"
    if visible(said) != said:
        return "an escape sequence reached the terminal"
    missing = [word for word in words if word not in said]
    return f"nothing says {missing[0]!r}: {said[-300:]}" if missing else ""


def _command(make: Callable[[Path], tuple[tuple[str, ...], tuple[int, ...], tuple[str, ...]]]) -> Play:
    """Return a row that runs a command, given its words, the exit codes that are right, and what it must say."""

    async def play(directory: Path) -> str:
        words, codes, wanted = make(directory)
        return _fault(*await _said(*words), codes, *wanted)

    return play


# --- khala advise ---------------------------------------------------------------------------------------

RUN: Final = "doors"
WHERE: Final[dict[str, Any]] = {"run": RUN, "side": "blue", "episode": 0}


def _card() -> Run:
    card = run_card(MatchConfig(task=load_task("2s3z_pair"), run=RUN), GAME)
    return card.but(advisers=("Ada",), episodes=1)


def _report(words: str = "") -> Report:
    return Report(
        **WHERE, step=0, game_loop=8, messages=(Received(sender=f"Stalkers{words}", recipient="all", text=words),),
        agents=(AgentReport(agent=f"Stalkers{words}", side="blue", status="ok", detail=words),),
    )  # fmt: skip


def _result(words: str = "") -> Result:
    return Result(
        **WHERE, outcome="win", cause=f"enemy defeated{words}", steps=1, game_loop=8, game_s=0.4, wall_s=2.0,
        killed=Casualties(), lost=Casualties(), kd=None,
    )  # fmt: skip


async def _advise(payloads: Mapping[Topic, list[bytes]]) -> tuple[list[Any], list[str]]:
    """Advise in a match whose host sends these bytes; return what was shown, and the complaints."""
    broker = MemoryBroker()
    shown = list[Any]()
    complaints = list[str]()
    host = broker.session()
    await host.announce(host_key(RUN))
    cards = await host.publisher(run_key(RUN, Topic.RUN), Delivery.STATE)
    await cards.put(encode(_card()))
    begun = asyncio.Event()

    def show(message: Any) -> None:
        shown.append(message)
        begun.set()

    async def no_lines() -> AsyncIterator[str]:
        return
        yield

    advising = Advising(broker.session(), Adviser(RUN, "blue", "Ada"), show=show, complain=complaints.append)
    playing = asyncio.create_task(advising.play(no_lines()))
    async with asyncio.timeout(PATIENCE_S):
        await begun.wait()
        for topic, sent in payloads.items():
            publisher = await host.publisher(
                run_key(RUN, topic), Delivery.STATE if topic is Topic.RESULT else Delivery.LOG
            )
            for payload in sent:
                await publisher.put(payload)
        await playing
    return shown, complaints


async def _malformed_reports(_: Path) -> str:
    junk = [b"", b"{", b"[]", b"\xff\xfe", b"null", json.dumps({"kind": "report", "v": 9}).encode(), b"[" * 100_000]
    shown, complaints = await _advise({Topic.REPORT: [*junk, encode(_report())], Topic.RESULT: [encode(_result())]})
    if not any(isinstance(message, Report) for message in shown):
        return "the adviser sees no more reports"
    return "" if len(complaints) == len(junk) else f"{len(complaints)} complaints about {len(junk)} malformed reports"


async def _malformed_result(_: Path) -> str:
    shown, complaints = await _advise({Topic.RESULT: [b"{", encode(_result())]})
    if not any(isinstance(message, Result) for message in shown):
        return "the adviser does not see the result"
    return "" if complaints else "nobody heard of the malformed result"


async def _evil_words(_: Path) -> str:
    shown, _complaints = await _advise({Topic.REPORT: [encode(_report(EVIL))], Topic.RESULT: [encode(_result(EVIL))]})
    text = "\n".join(line for message in shown for line in lines_about(message))
    if "owned" not in text:
        return "the words are not shown at all"
    return "an escape sequence reached the terminal" if visible(text) != text else ""


async def _lines_of_json(directory: Path) -> str:
    """Read what `khala advise --json` prints of words with escape sequences."""
    from khala_sc2.commands import advise  # noqa: PLC0415  # its session is replaced below

    class Stub:
        def __init__(self, *_: Any, show: Callable[[Any], None], **__: Any) -> None:
            self._show = show

        async def play(self, *_: Any, **__: Any) -> None:
            self._show(_report(EVIL))

    printed: list[str] = []
    with (
        mock.patch.object(advise, "Advising", Stub),
        mock.patch.object(advise, "open_bus", mock.AsyncMock()),
        mock.patch.object(advise, "say", lambda text, **_: printed.append(visible(text))),
    ):
        options: dict[str, Any] = {"connect": ["tcp/127.0.0.1:7447"], "tls": None, "insecure": False, "as_json": True}
        await asyncio.to_thread(advise.run_advise, Adviser(RUN, "blue", "Ada"), **options)
    del directory
    try:
        return "" if json.loads(printed[0])["messages"][0]["text"] == EVIL else "other words were printed"
    except ValueError as error:
        return f"what it prints is no JSON: {error}"


async def _odd_advisers(_: Path) -> str:
    """Advise under names that are wildcards, paths and controls on a bus that runs over the internet."""
    for name in ("*", "**", "../blue/Stalkers", "a/b", "\x1b[2J", "", "@adv", "$*", "a" * 1000):
        advising = Advising(
            MemoryBroker().session(), Adviser(RUN, "blue", name), show=lambda _: None, complain=lambda _: None
        )
        try:
            await advising.play(_nothing(), find_s=0.0)
        except ConfigError as error:
            if visible(name) != name and name in str(error):
                continue  # `say` makes it visible
        else:
            return f"{name!r} was let in"
    return ""


async def _nothing() -> AsyncIterator[str]:
    return
    yield


# --- khala calibrate ------------------------------------------------------------------------------------

SAMPLES: Final = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)


def _calibration() -> dict[str, Any]:
    def measurement(samples: tuple[float, ...], *, exact: bool) -> Measured:
        return Measured(
            unit="s", exact=exact, resolution=0, run_s=1, loops=1, values={"a": Values.of(samples)}
        )  # fmt: skip

    made = Calibration(
        khala="1", game="g", version="4.10", build=1, data_version="d", platform="p", seed=1,
        probes={"move.speed": measurement(SAMPLES, exact=False), "weapon.range": measurement((1.0,), exact=True)},
    )  # fmt: skip
    return made.model_dump(mode="json")


def _compare(path: Path, directory: Path) -> str:
    """Compare a file with a good one, both ways; return how it got through."""
    good = directory / "good.json"
    good.write_text(json.dumps(_calibration()), encoding="utf-8")
    for pair in ((good, path), (path, good)):
        said, through = capture(partial(calibrating.show_comparison, *pair, as_json=False))
        if through:
            return through
        if "not a file of `khala calibrate`" not in said and "cannot be read" not in said:
            return f"it was compared: {said[:200]!r}"
    return ""


def _bad_calibration(make: Callable[[Path], object]) -> Play:
    async def play(directory: Path) -> str:
        path = directory / "bad.json"
        make(path)
        try:
            async with asyncio.timeout(PATIENCE_S):
                return await asyncio.to_thread(_compare, path, directory)
        except TimeoutError:
            return "it waits for ever"

    return play


def _with(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], object]:
    def make(path: Path) -> None:
        made = _calibration()
        change(made)
        path.write_text(json.dumps(made), encoding="utf-8")

    return make


def _values(made: dict[str, Any]) -> dict[str, Any]:
    values: dict[str, Any] = made["probes"]["move.speed"]["values"]["a"]
    return values


def _large(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(65 * 2**20)


BAD_CALIBRATIONS: Final[dict[str, Callable[[Path], object]]] = {
    "a file of 65 MB": _large,
    "a pipe": os.mkfifo,
    "a file nested 100 000 deep": lambda path: path.write_text("[" * 100_000),
    "half a file": lambda path: path.write_text(json.dumps(_calibration())[:200]),
    "a file that is no text": lambda path: path.write_bytes(os.urandom(999)),
    "numbers that are none": _with(lambda made: _values(made).update(mean=float("nan"))),
    "numbers whose sum overflows": _with(lambda made: _values(made).update(samples=[1e308] * 7)),
    "a count that is not that of its samples": _with(lambda made: _values(made).update(samples=[])),
    "the recording of a match": lambda path: path.symlink_to(GOLDEN),
}


async def _forged_heading(directory: Path) -> str:
    """Compare with a file whose names hold Markdown and escape sequences: it must not write the report."""
    forged = f"x |\n# All is well\n{EVIL}"
    path = directory / "forged.json"
    made = _calibration() | {"game": forged, "platform": forged}
    made["probes"]["move.speed"]["failed"] = forged
    made["probes"][forged] = made["probes"]["weapon.range"]
    path.write_text(json.dumps(made), encoding="utf-8")
    good = directory / "good.json"
    good.write_text(json.dumps(_calibration()), encoding="utf-8")
    said, through = capture(partial(calibrating.show_comparison, good, path, as_json=False))
    if through or "owned" not in said:
        return through or "the names are not shown at all"
    if any(line.startswith("# All is well") for line in said.splitlines()):
        return "a name wrote a heading of its own"
    return "an escape sequence reached the terminal" if visible(said) != said else ""


async def _calibrate_onto(directory: Path) -> str:
    """Save onto a link, and on a disk that is full: what was there must stay."""
    made = Calibration.model_validate(_calibration())
    (directory / "precious").write_text("mine")
    (directory / "link.json").symlink_to(directory / "precious")
    made.save(directory / "link.json")
    if (directory / "precious").read_text() != "mine":
        return "a file behind a link is overwritten"
    before = (directory / "link.json").read_bytes()
    with mock.patch("os.fdopen", side_effect=OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))):
        said, through = capture(lambda: made.but(seed=2).save(directory / "link.json"))
    if through or "No space left" not in said:
        return through or f"it says {said!r}"
    return "" if (directory / "link.json").read_bytes() == before else "the file of before is lost"


# --- khala doctor ---------------------------------------------------------------------------------------

PROXY: Final = "http://me:geheim@127.0.0.1:9"


async def _proxy_password(_: Path) -> str:
    proxies = dict.fromkeys(("HTTP_PROXY", "http_proxy", "HTTPS_PROXY", "https_proxy", "ALL_PROXY"), PROXY)
    code, said = await _said("doctor", **proxies, NO_PROXY="", no_proxy="")
    if "geheim" in said:
        return "the password of the proxy is shown"
    return _fault(code, said, (0, 1), "127.0.0.1:9")


def _doctor(environ: Callable[[Path], dict[str, str]], *words: str) -> Play:
    async def play(directory: Path) -> str:
        code, said = await _said("doctor", **environ(directory))
        return _fault(code, said, (0, 1), *words) or ("it says to report it" if "report this" in said else "")

    return play


def _game_with_pipe(directory: Path) -> str:
    game = directory / "Versions" / "Base75689" / "SC2_x64"
    game.parent.mkdir(parents=True)
    os.mkfifo(game)
    return str(directory)


DOCTORS: Final[dict[str, tuple[Callable[[Path], dict[str, str]], tuple[str, ...]]]] = {
    "SC2PATH is a file": (lambda _: {"SC2PATH": __file__}, ("holds no Versions",)),
    "SC2PATH is an empty directory": (lambda directory: {"SC2PATH": str(directory)}, ("holds no Versions",)),
    "SC2PATH is the home of nobody": (lambda _: {"SC2PATH": "~nobody-of-this-name"}, ("holds no Versions",)),
    "SC2PATH has escape sequences": (lambda _: {"SC2PATH": EVIL}, ("owned",)),
    "the program of a game is a pipe": (lambda directory: {"SC2PATH": _game_with_pipe(directory)}, ("Python",)),
    "a terminal of ASCII, and an unknown language": (
        lambda _: {"PYTHONIOENCODING": "ascii", "LC_ALL": "xx_YY", "LANG": "xx_YY", "SC2PATH": "/…"}, ("\\u2026",),
    ),
    "a proxy that is no address": (lambda _: {"HTTPS_PROXY": f"http://[{EVIL}", "https_proxy": "http://["}, ("proxy",)),
    "certificates of the machine that are none": (lambda _: {"SSL_CERT_FILE": __file__}, ("trusted certificates",)),
    "an engine that nobody knows": (lambda _: {"KHALA_ENGINE": EVIL}, ("engine",)),
}  # fmt: skip


# --- khala keys show ------------------------------------------------------------------------------------


def _write_keys(directory: Path) -> Path:
    make_authority(directory / "keys", ["127.0.0.1"])
    return directory / "keys"


def _certificate(directory: Path) -> Path:
    return _write_keys(directory) / "router" / "certificate.pem"


def _replace(make: Callable[[Path], object]) -> Callable[[Path], Path]:
    def write(directory: Path) -> Path:
        path = _certificate(directory)
        whole = path.read_bytes()
        path.unlink()
        path.with_suffix(".whole").write_bytes(whole)
        make(path)
        return path

    return write


def _torn(path: Path) -> None:
    whole = path.with_suffix(".whole").read_bytes()
    path.write_bytes(whole[: len(whole) // 2])


BAD_CERTIFICATES: Final[dict[str, Callable[[Path], object]]] = {
    "half a file": _torn,
    "bytes at random": lambda path: path.write_bytes(os.urandom(500)),
    "a key in its place": lambda path: path.write_bytes((path.parent / "key.pem").read_bytes()),
    "a directory": lambda path: path.mkdir(),
    "a pipe": os.mkfifo,
    "a link to an endless device": lambda path: path.symlink_to("/dev/zero"),
    "a link to itself": lambda path: path.symlink_to(path),
}


def _show_keys(make: Callable[[Path], object], *command: str) -> Play:
    """Return a row that shows keys of which a certificate is bad: a sentence says which, and all ends soon."""

    async def play(directory: Path) -> str:
        path = _replace(make)(directory)
        code, said = await _said(*command, str(path.parent.parent))
        if path.is_symlink() and not path.exists():
            return _fault(code, said, (0, 1))  # as if there were none
        return _fault(code, said, (1,), "certificate.pem") or ("it says to report it" if "report this" in said else "")

    return play


async def _mutated_certificates(directory: Path) -> str:
    """Change bytes of a certificate: it is read, or refused in a sentence."""
    path = _certificate(directory)
    dice = random.Random(7)
    lines = path.read_text().splitlines()
    whole = b64decode("".join(lines[1:-1]))
    for _ in range(1500):
        changed = bytearray(whole)
        for _change in range(dice.randint(1, 3)):
            changed[dice.randrange(len(changed))] = dice.randrange(256)
        path.write_text(f"{lines[0]}\n{b64encode(changed).decode()}\n{lines[-1]}\n")
        with contextlib.suppress(BusError):
            read(path)
    return ""


def _write_certificate(directory: Path, name: str, days: int) -> Path:
    """Write a certificate of a name and a time that `khala keys` would not give it."""
    from datetime import UTC, datetime, timedelta  # noqa: PLC0415  # this row alone needs a calendar

    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    now = datetime.now(UTC)
    made = (
        x509.CertificateBuilder().subject_name(subject).issuer_name(subject).public_key(key.public_key())
        .serial_number(1).not_valid_before(now - timedelta(days=99)).not_valid_after(now + timedelta(days=days))
        .sign(key, SHA256())
    )  # fmt: skip
    place = directory / "keys" / "agent"
    place.mkdir(parents=True)
    from cryptography.hazmat.primitives.serialization import Encoding  # noqa: PLC0415  # likewise

    (place / "certificate.pem").write_bytes(made.public_bytes(Encoding.PEM))
    return directory / "keys"


def _names_with_escapes(directory: Path) -> tuple[tuple[str, ...], tuple[int, ...], tuple[str, ...]]:
    return ("keys", "show", str(_write_certificate(directory, EVIL[:60], 9))), (0,), ("owned",)


def _expired_for_doctor(directory: Path) -> tuple[tuple[str, ...], tuple[int, ...], tuple[str, ...]]:
    return ("doctor", "--tls", str(_write_certificate(directory, "router", -9))), (1,), ("expired on",)


def _expired_for_show(directory: Path) -> tuple[tuple[str, ...], tuple[int, ...], tuple[str, ...]]:
    return ("keys", "show", str(_write_certificate(directory, "router", -9))), (0,), ("expired",)


def _readable(directory: Path) -> Path:
    where = _write_keys(directory)
    (where / "host" / "key.pem").chmod(0o644)
    return where


def _readable_shown(directory: Path) -> tuple[tuple[str, ...], tuple[int, ...], tuple[str, ...]]:
    return ("keys", "show", str(_readable(directory))), (0,), ("others can read",)


# --- khala knowledge write ------------------------------------------------------------------------------


@contextlib.contextmanager
def _facts_in(directory: Path) -> Iterator[Path]:
    """Have the facts in a directory of the row, small ones: what is written is the same code."""
    made = {f"{kind}.json": f'{{"{kind}": 1}}\n' for kind in ("units", "abilities")}
    with (
        mock.patch.object(facts, "directory", lambda version: directory / version),
        mock.patch.object(facts, "facts", return_value=made),
    ):
        yield directory / "4.10"


async def _full_disk(directory: Path) -> str:
    with _facts_in(directory) as where:
        facts.write("4.10")
        before = {path.name: path.read_bytes() for path in where.iterdir()}
        fdopen = os.fdopen
        with mock.patch("os.fdopen", lambda *given: FullFile(fdopen(*given), 5)):
            said, through = capture(partial(knowledge.write, version="4.10", check=False))
        if through or "No space left" not in said:
            return through or f"it says {said!r}"
        return "" if {path.name: path.read_bytes() for path in where.iterdir()} == before else "facts are lost"


async def _linked_facts(directory: Path) -> str:
    with _facts_in(directory) as where:
        where.mkdir()
        (directory / "precious").write_text("mine")
        (where / "units.json").symlink_to(directory / "precious")
        facts.write("4.10")
    return "" if (directory / "precious").read_text() == "mine" else "a file behind a link is overwritten"


def _damaged_facts(damage: Callable[[Path], object]) -> Play:
    async def play(directory: Path) -> str:
        with _facts_in(directory) as where:
            facts.write("4.10")
            (where / "units.json").unlink()
            damage(where / "units.json")
            said, through = capture(partial(knowledge.write, version="4.10", check=True))
        return through or ("" if "4.10/units.json" in said and "abilities" not in said else f"it says {said!r}")

    return play


# --- khala llm ------------------------------------------------------------------------------------------

REQUEST: Final[dict[str, Any]] = {"model": "silent", "messages": [{"role": "user", "content": "Team A"}]}
STEP_S: Final = 3.0


async def _ask(http: aiohttp.ClientSession, endpoint: Endpoint, body: bytes, **headers: str) -> int:
    async with http.post(f"{endpoint.base_url}/chat/completions", data=body, headers=headers) as answer:
        await answer.read()
        return answer.status


async def _mutated_requests(_: Path) -> str:
    """Change what a request says, byte by byte and value by value: a status says what is wrong, never 500."""
    dice = random.Random(3)
    whole = json.dumps(REQUEST).encode()
    junk = [b"", b"null", b"[]", b"{", b"[" * 50_000, b'{"model": "\\ud800", "messages": []}', b"\xff" * 50]
    junk += [json.dumps(REQUEST | change).encode() for change in CHANGES]
    for _number in range(150):
        changed = bytearray(whole)
        changed[dice.randrange(len(changed))] = dice.randrange(256)
        junk.append(bytes(changed))
    async with Endpoint() as endpoint, aiohttp.ClientSession() as http:
        for body in junk:
            if (status := await _ask(http, endpoint, body)) not in {200, 400, 404}:
                return f"{body[:60]!r} was answered with {status}"
        return "" if await _ask(http, endpoint, whole) == 200 else "it does not answer afterwards"


CHANGES: Final[tuple[dict[str, Any], ...]] = (
    {"model": None}, {"model": ["silent"]}, {"model": "../silent"}, {"model": "x" * 100_000}, {"messages": {}},
    {"messages": [None]}, {"messages": [{"role": "tool", "content": ""}]}, {"messages": []}, {"stream": True},
    {"messages": [{"role": "user", "content": [{"type": "image_url", "image_url": {"url": "file:///etc/passwd"}}]}]},
)  # fmt: skip


async def _long_prompts(_: Path) -> str:
    """Ask every player with texts on which careless patterns take hours; another client must not wait for them."""
    texts = [unit * (20_000 // len(unit)) for unit in (" ", "[", "(", "        a", "\n    Team A: <a(b)>", "1, ")]
    async with Endpoint() as endpoint, aiohttp.ClientSession() as http:
        for model in ("skilled", "focus-fire", "random-legal"):
            for text in texts:
                content = f"Current state\n    Team A: {text}\nTeam A\n    Enemy units: \n        {text}"
                body = json.dumps({"model": model, "messages": [{"role": "user", "content": content}]}).encode()
                began = asyncio.get_running_loop().time()
                if (status := await _ask(http, endpoint, body)) != 200:
                    return f"{model} answered {text[:10]!r}… with {status}"
                if (took_s := asyncio.get_running_loop().time() - began) > STEP_S:
                    return f"{model} thinks {took_s:.1f} s about {text[:10]!r}…"
    return ""


async def _send_zipped(_: Path) -> str:
    """Send a body that is small until it is unpacked."""
    import gzip  # noqa: PLC0415  # this row alone packs

    bomb = gzip.compress(bytes(64 * 2**20))
    async with Endpoint() as endpoint, aiohttp.ClientSession() as http:
        status = await _ask(http, endpoint, bomb, **{"Content-Encoding": "gzip"})
        if status not in {400, 413}:
            return f"64 MB in {len(bomb)} bytes were answered with {status}"
        return (
            "" if await _ask(http, endpoint, json.dumps(REQUEST).encode()) == 200 else "it does not answer afterwards"
        )


# --- khala router ---------------------------------------------------------------------------------------


@asynccontextmanager
async def _router(directory: Path) -> AsyncIterator[tuple[ZenohBus, Path]]:
    """Run a router over TLS for the agents of a task, as `khala router --tls` does."""
    where = directory / "keys"
    make_authority(where, ["127.0.0.1"])
    certify_agent(where, "blue", "Stalkers")
    certify_agent(where, "blue", "Zealots")
    rules = access_rules([load_task("2s3z_pair")], RUN)
    tls = files_of(where, "router")
    bus = await open_bus(BusConfig(mode="router", listen=("tls/127.0.0.1:0",), tls=tls, zenoh=rules))
    try:
        yield bus, where
    finally:
        await bus.close()


async def _is_honest_heard(bus: ZenohBus, where: Path, name: str = "Stalkers") -> str:
    """Have an agent join and write; return how it fares, "" if the host hears it."""
    key = agent_key(RUN, "blue", name, Topic.REPLY)
    heard = await bus.subscribe(key, Delivery.SPEECH)
    client = await open_bus(BusConfig(connect=bus.endpoints, tls=files_of(where, f"agent:blue/{name}")))
    try:
        await (await client.publisher(key, Delivery.SPEECH)).put(b"hello")
        async with asyncio.timeout(PATIENCE_S):
            return "" if (await anext(heard)).payload == b"hello" else "other words arrived"
    except TimeoutError:
        return "an honest agent is not heard any more"
    finally:
        await heard.close()
        await client.close()


async def _garbage(directory: Path) -> str:
    """Send what is no TLS to the port of a router, and leave handshakes half-open."""
    dice = random.Random(1)
    async with _router(directory) as (bus, where):
        port = host_port_of(bus.endpoints[0])[1]
        with contextlib.ExitStack() as stack:
            for number in range(60):
                peer = stack.enter_context(socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S))
                head = b"\x16\x03\x01\x02\x00\x01" if number % 2 else b""  # the begin of a handshake, or none of it
                with contextlib.suppress(OSError):
                    peer.sendall(head + dice.randbytes(2000 if number % 3 else 0))
            return await _is_honest_heard(bus, where)


async def _refused_peer(directory: Path, tls: Callable[[Path, Path], ssl.SSLContext | TlsFiles]) -> str:
    """Connect with certificates that are not ours: the handshake must fail."""
    async with _router(directory) as (bus, where):
        given = tls(where, directory)
        assert isinstance(given, TlsFiles)
        config = BusConfig(connect=bus.endpoints, tls=given, connect_timeout_s=1.0)
        try:
            client = await open_bus(config)
        except BusError:
            return await _is_honest_heard(bus, where)
        await client.close()
        return "it was let in"


def _foreign(where: Path, directory: Path) -> TlsFiles:
    """Return a certificate for the same name by another authority, beside our own authority."""
    make_authority(directory / "foreign", ["127.0.0.1"])
    theirs = certify_agent(directory / "foreign", "blue", "Stalkers")
    return TlsFiles(ca=where / "ca" / "ca.pem", certificate=theirs / "certificate.pem", key=theirs / "key.pem")


async def _no_certificate(directory: Path) -> str:
    """Speak TLS without a certificate: after the handshake, the router must say that it wants one."""
    async with _router(directory) as (bus, where):
        port = host_port_of(bus.endpoints[0])[1]
        context = ssl.create_default_context(cafile=str(where / "ca" / "ca.pem"))
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port, ssl=context)
            async with asyncio.timeout(PATIENCE_S):
                if await reader.read(1):
                    return "the router talks to a peer without a certificate"
            writer.close()
        except (ssl.SSLError, ConnectionError):
            pass
        return await _is_honest_heard(bus, where)


async def _foreign_keys(directory: Path, key: str) -> str:
    """Have an agent write under a key that is not its own, and then under its own: the second arrives alone.

    Its session is told of no listener there, so it writes as a program would that does not ask.
    """
    own = agent_key(RUN, "blue", "Zealots", Topic.REPLY)
    async with _router(directory) as (bus, where):
        forged = await bus.subscribe(key, Delivery.SPEECH)
        heard = await bus.subscribe(own, Delivery.SPEECH)
        mallory = await open_bus(BusConfig(connect=bus.endpoints, tls=files_of(where, "agent:blue/Zealots")))
        try:
            for place in (key, own):  # on one link, so in this order
                mallory._session.put(place, b"words")  # noqa: SLF001  # as above
            async with asyncio.timeout(PATIENCE_S):
                await anext(heard)
        finally:
            await mallory.close()
        await forged.close()
        return f"it wrote under {key}" if [sample async for sample in forged] else ""


async def _read_foreign_keys(directory: Path) -> str:
    """Have an agent read what another is told, and then what is for itself: it gets the second alone."""
    async with _router(directory) as (bus, where):
        mallory = await open_bus(BusConfig(connect=bus.endpoints, tls=files_of(where, "agent:blue/Zealots")))
        try:
            heard = await mallory.subscribe(f"khala/{RUN}/**", Delivery.STATE)
            own = await mallory.subscribe(agent_key(RUN, "blue", "Zealots", Topic.OBSERVATION), Delivery.STATE)
            for name in ("Stalkers", "Zealots"):
                key = agent_key(RUN, "blue", name, Topic.OBSERVATION)
                await (await bus.publisher(key, Delivery.STATE)).put(name.encode())
            async with asyncio.timeout(PATIENCE_S):
                await anext(own)
            await heard.close()
            return "it read what another agent was told" if any([s.payload == b"Stalkers" async for s in heard]) else ""
        finally:
            await mallory.close()


# --- khala try ------------------------------------------------------------------------------------------

KEY: Final = "sk-test-0123456789abcdef-do-not-tell"


def _try(answer: Given, codes: tuple[int, ...], *wanted: str) -> Play:
    """Return a row that tries a model whose endpoint answers so, with a key that nobody may see."""

    async def play(directory: Path) -> str:
        async with Canned(answer) as endpoint:
            (directory / "m.yaml").write_text(
                f"profile: compatible\nmodel: m\nbase_url: {endpoint.base_url}\napi_key_env: TRIED_KEY\n"
                "retry: {tries: 1}\n"
            )
            file = str(directory / "m.yaml")
            code, said = await _said("try", file, "--answer", "text", "--timeout", "5", TRIED_KEY=KEY)
        return "the key is shown" if KEY in said else _fault(code, said, codes, *wanted)

    return play


# --- the rows -------------------------------------------------------------------------------------------


def _rows() -> Iterator[Row]:
    advise, calibrate, doctor = "khala advise", "khala calibrate", "khala doctor"
    yield Row(advise, "reports that are none", _malformed_reports)
    yield Row(advise, "a result that is none", _malformed_result)
    yield Row(advise, "escape sequences in reports", _evil_words)
    yield Row(advise, "escape sequences in lines of JSON", _lines_of_json, "quirk")
    yield Row(advise, "names of advisers that are wildcards and paths", _odd_advisers)
    for what, make in BAD_CALIBRATIONS.items():
        yield Row(calibrate, f"--compare with {what}", _bad_calibration(make), "quirk")
    yield Row(calibrate, "--compare with names that hold Markdown and escape sequences", _forged_heading)
    yield Row(calibrate, "a link where the file is to be, and a disk that fills up", _calibrate_onto, "fault")
    yield Row(doctor, "a proxy with a password", _proxy_password)
    for what, (environ, words) in DOCTORS.items():
        yield Row(doctor, what, _doctor(environ, *words), "attack" if "escape" in what else "quirk")
    yield Row(doctor, "a certificate that has expired", _command(_expired_for_doctor), "fault")
    for what, damage in BAD_CERTIFICATES.items():
        yield Row("khala keys show", f"a certificate that is {what}", _show_keys(damage, "keys", "show"))
    yield Row(doctor, "a certificate that is half a file", _show_keys(_torn, "doctor", "--tls"), "fault")
    yield Row("khala keys show", "1500 certificates with broken bytes", _mutated_certificates, "fault")
    yield Row("khala keys show", "a name with escape sequences", _command(_names_with_escapes))
    yield Row("khala keys show", "a certificate that has expired", _command(_expired_for_show), "fault")
    yield Row("khala keys show", "a key that others can read", _command(_readable_shown), "fault")
    yield Row("khala knowledge write", "a disk that fills up", _full_disk, "fault")
    yield Row("khala knowledge write", "a link where a file is to be", _linked_facts)
    for what, damage in FACTS.items():
        yield Row("khala knowledge write", f"--check of {what}", _damaged_facts(damage), "fault")
    orders = f"Analysis: {EVIL}\nActions:\nTeam Stalker-1:\n<Move_Screen([12, 6])>"
    yield Row("khala try", "escape sequences in a reply", _try(completion(orders), (0,), "carried out"))
    yield Row("khala try", "escape sequences and the key in an error", _try(refusal(400, EVIL + KEY), (1,), "http 400"))
    yield Row("khala try", "an endpoint that answers anything with a list", _try(Given([1]), (1,), "failed"), "quirk")
    yield Row("khala llm", "150 requests with broken bytes, and odd values", _mutated_requests, "fault")
    yield Row("khala llm", "prompts that take patterns long to read", _long_prompts)
    yield Row("khala llm", "a body of 64 MB in 64 kB", _send_zipped)
    yield Row("khala router", "garbage, and handshakes that are half-open", _garbage)
    yield Row("khala router", "a certificate of another authority", partial(_refused_peer, tls=_foreign))
    yield Row("khala router", "TLS without a certificate", _no_certificate)
    for what, key in FOREIGN_KEYS.items():
        yield Row("khala router", f"an agent that writes {what}", partial(_foreign_keys, key=key))
    yield Row("khala router", "an agent that reads what another is told", _read_foreign_keys)


FOREIGN_KEYS: Final = {
    "another agent's reply": agent_key(RUN, "blue", "Stalkers", Topic.REPLY),
    "its own observation": agent_key(RUN, "blue", "Zealots", Topic.OBSERVATION),
    "the host's report": run_key(RUN, Topic.REPORT),
}
FACTS: Final[dict[str, Callable[[Path], object]]] = {
    "a file that is no text": lambda path: path.write_bytes(b"\xff\xfe"),
    "a directory": lambda path: path.mkdir(),
    "a pipe": os.mkfifo,
}
ROWS: Final[tuple[Row, ...]] = tuple(_rows())
