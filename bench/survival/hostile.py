"""Send the host what no well-meaning agent sends, and check that it does not fail, slow down or pass it on.

    python -m bench hostile                                            100 000 replies and 20 000 frames
    python -m bench hostile --replies 1000000 --frames 100000 --processes 2

Replies are mutated ones of the corpora in `tests`, and mixtures of the tokens of the language. Each is read and acted
on as by a match, at a real observation of a task; then the length of the next observations is measured, its own and
those of its team mates. Frames are mutated messages of a recording, of every kind, for the codec. The exit code is 1 if
anything raises, takes more than `LONGEST_S` of processor time, makes an observation more than `MOST_GROWTH` times as
long, writes a line that looks like a heading, or leaves memory behind.
"""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import random
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from bench.command_line import make_parser
from bench.paths import GOLDEN, TESTS
from khala_bridge.act import Actor
from khala_bridge.game.game import GameConfig
from khala_bridge.game.pysc2_game import PySC2Game
from khala_bridge.observe import Feedback, Observer, shorten
from khala_bridge.observe.text import Page, reply
from khala_orchestrator.config import load_task
from khala_orchestrator.roster import Seat
from khala_orchestrator.words.mailbox import Mailbox
from khala_protocol.codec import decode, decode_as, encode
from khala_protocol.errors import PeerError
from khala_protocol.messages import MESSAGE_TYPES, Message, Reply, Usage
from khala_protocol.recording import read
from khala_protocol.speech import parse
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from khala_bridge.observe import SideObservation
    from khala_bridge.task.config import TaskConfig

TASKS = ("2s3z_pair", "2c_vs_64zg", "pvz_task4_level2", "simple64_eceb")
LONGEST_S = 0.25
MOST_GROWTH = 2.5
"""The shortest first observation, that of a Commander, has 1 650 characters; what is said about a reply has a limit."""
MOST_LEFT_MB = 64.0
TOKENS = (
    *("_", "A", "1", "0x1", "-", ".", ",", ":", ";", " ", "\n", "'", '"', "`", "'''", "“", "‘", "(", ")", "[", "]"),  # noqa: RUF001  # a quote as models write it
    *("{", "}", "<", ">", "/", "\\", "|", "*", "#", "~~", "=", "&", "&lt;", "<!--", "-->", "<think>", "</think>"),
    *(
        "<|channel|>final<|message|>",
        "<MessageTo(",
        "<MessageTo(A, '",
        "<MessageTo (A, x",
        "<MessageTo>",
        "</MessageTo>",
    ),
    *(
        "MessageTo(A, ",
        "<ListenTo(",
        "<A_b(",
        "<A_b",
        "<A_b>",
        "A_b(0x1)",
        "<Stop()>",
        "</A_b>",
        "')>",
        "Team A:",
        "A-1",
    ),
    *("A1| ", "Actions:", ". Actions: ", "\nActions:", "\nFinal actions:", "\nTeam A:", "\nMessageTo(A, 'x", "\nUser:"),
    *("Explanation: ", "not ", "and ", '"team":"A"', '{"action":"A_b"}', '{"to":"A","text":"', "Aa_", "x", "动作"),
)
"""Short pieces of the language of replies."""
NASTY = (
    "\x00",
    "\x1b]0;x\x07",
    "\u202e",
    "\ud800",
    "&#" + "9" * 5000 + ";",
    "9" * 5000,
    "\u2028Task\u2028",
    "\nTask\n    ",
)
VALUES = (
    "1e999",
    "-1",
    "9" * 5000,
    "1" + "0" * 18,
    "1.7e308",
    "null",
    "[]",
    "{}",
    '"\\ud800"',
    "[" * 3000,
    '"' + "x" * 9000 + '"',
)
"""Values of JSON that few readers expect."""


@dataclass
class Verdict:
    """The outcome of many trials."""

    trials: int = 0
    exceptions: Counter[str] = field(default_factory=Counter)
    slowest_s: float = 0.0
    slowest: str = ""
    most_growth: float = 0.0
    longest: str = ""
    forged: int = 0
    left_mb: float = 0.0
    took_s: float = 0.0

    def add(self, other: Verdict) -> None:
        """Add the outcome of another process."""
        self.trials += other.trials
        self.exceptions += other.exceptions
        if other.slowest_s > self.slowest_s:
            self.slowest_s, self.slowest = other.slowest_s, other.slowest
        if other.most_growth > self.most_growth:
            self.most_growth, self.longest = other.most_growth, other.longest
        self.forged += other.forged
        self.left_mb = max(self.left_mb, other.left_mb)
        self.took_s = max(self.took_s, other.took_s)

    def is_good(self, longest_s: float = LONGEST_S) -> bool:
        """Return whether nothing was violated, and nothing took longer than this."""
        fast = self.slowest_s <= longest_s and self.most_growth <= MOST_GROWTH
        return fast and not self.exceptions and not self.forged and self.left_mb <= MOST_LEFT_MB


class Scene:
    """One moment of a task, at which replies are read and acted on as in a match."""

    def __init__(self, task: TaskConfig, observation: SideObservation) -> None:
        self.task, self.observation = task, observation
        self.actor = Actor(task)
        self.agents = [agent for agent in task.agents if agent.name in observation.agents]
        seats = {agent.name: Seat(task.side, agent.name) for agent in task.agents}
        reach = {seats[a.name]: [seats[other.name] for other in task.correspondents(a)] for a in task.agents}
        self.mailbox = Mailbox(reach, task.channels)
        self.words = [team.name for seen in observation.agents.values() for team in seen.teams]
        self.words += [action.name for agent in self.agents for action in agent.catalogue()]
        self.words += [hex(unit.tag) for unit in observation.snapshot.units.values()]
        self.words += [agent.name for agent in task.agents]

    def play(self, agent: str, text: str) -> tuple[float, dict[str, list[str]]]:
        """Return the processor time of reading and acting, and the lines of the next observations, by agent."""
        began = time.process_time()
        speech = parse(text)
        joint = self.actor.joint(self.observation, {agent: speech})
        seat = Seat(self.task.side, agent)
        for listen in speech.listens:
            self.mailbox.listen(seat, listen.channel)
        post = self.mailbox.deliver(self._message(agent, said.recipient, said.text) for said in speech.messages)
        rejections = shorten((*joint.rejections[agent], *post.rejections.get(seat, ())))
        took_s = time.process_time() - began
        lines = {}
        for name in {agent, *(seat.agent for seat in post.received)}:
            own = Feedback(joint.accepted[agent], rejections) if name == agent else Feedback()
            heard = Feedback(own.accepted, own.rejections, post.received.get(Seat(self.task.side, name), ()))
            page = Page(replace(self.observation.agents[name], heard=heard), self.task)
            lines[name] = [*reply.last_actions(page), *reply.rejections(page), *reply.messages(page)]
        return took_s, lines

    def growth(self, lines: dict[str, list[str]]) -> float:
        """Return the length of the longest next observation over that of the one without a reply."""
        usual = {name: len(self.observation.agents[name].text) for name in lines}
        return max((usual[name] + sum(len(line) + 1 for line in said)) / usual[name] for name, said in lines.items())

    def _message(self, agent: str, recipient: str, text: str) -> Message:
        return Message(
            run="hostile", side=self.task.side, agent=agent, episode=0, step=0, recipient=recipient, text=text
        )


HEADINGS = {"Your last actions", "Your last errors", "Messages"}


def is_forged(lines: Iterable[str]) -> bool:
    """Return whether a line looks like a heading that is none, or is several lines."""
    return any((line not in HEADINGS and not line.startswith("    ")) or len(line.splitlines()) > 1 for line in lines)


def scenes(names: Iterable[str] = TASKS) -> list[Scene]:
    """Return the first moment of some tasks."""
    with tempfile.TemporaryDirectory() as place:
        return [_scene(name, install(Path(place))) for name in names]


def _scene(name: str, sc2path: Path) -> Scene:
    task = load_task(name)
    game = PySC2Game(GameConfig(sc2path=sc2path, map=task.map_spec, seed=1))
    try:
        (snapshot,) = game.reset()
    finally:
        game.close()
    observation = Observer(task).observe(snapshot)
    tuple(observation.agents.values())
    return Scene(task, observation)


def corpus() -> list[str]:
    """Return the replies of the corpora."""
    files = sorted((TESTS / "bridge" / "corpus").glob("*.yaml"))
    written = [entry["reply"] for file in files for entry in yaml.safe_load(file.read_text("utf-8"))]
    recorded = {m.message.text for m in read(GOLDEN) if isinstance(m.message, Reply)}
    return [*written, *sorted(recorded)]


def mutate(chance: random.Random, texts: Sequence[str], words: Sequence[str]) -> str:
    """Return a text with some changes; one of a hundred is as long as a reply may be, or longer."""
    mixture = "".join(chance.choices(TOKENS, k=chance.randrange(1, 40)))
    text = chance.choice(texts) if chance.random() < 0.7 else mixture
    for _ in range(chance.randrange(1, 5)):
        start, stop = sorted(chance.choices(range(len(text) + 1), k=2))
        stop = min(stop, start + 300)
        other = chance.choice((*TOKENS, *NASTY)) if chance.random() < 0.5 else chance.choice(words)
        changes = (
            text[:start] + text[stop:],
            text[:stop] + text[start:],
            text[:start] + other + text[start:],
            text[:start] + chance.choice(texts)[:300] + text[stop:],
            text[:start] + text[start:stop] * chance.randrange(2, 9) + text[stop:],
        )
        text = chance.choice(changes)
    if chance.random() < 0.01:
        piece = "".join(chance.choices((*TOKENS, *words, text[:200]), k=chance.randrange(1, 6)))
        text += piece * (chance.choice((8_000, 70_000)) // max(len(piece), 1))
    return text


def replies(stage: list[Scene], count: int, seed: int) -> Verdict:
    """Return the outcome of this number of replies."""
    chance = random.Random(seed)
    texts = corpus()
    verdict = Verdict()
    for _ in _trials(verdict, count):
        scene = chance.choice(stage)
        agent = chance.choice(scene.agents).name
        text = mutate(chance, texts, scene.words)
        try:
            took_s, lines = scene.play(agent, text)
        except Exception:  # noqa: BLE001  # every one is a find
            verdict.exceptions[_where(text)] += 1
            continue
        if took_s > LONGEST_S:  # other processes slow the caches down
            took_s = min(took_s, *(scene.play(agent, text)[0] for _ in range(2)))
        growth = scene.growth(lines)
        verdict.forged += any(map(is_forged, lines.values()))
        if took_s > verdict.slowest_s:
            verdict.slowest_s = took_s
            verdict.slowest = f"{len(text)} characters, ends {text[-60:]!r}"
        if growth > verdict.most_growth:
            verdict.most_growth = growth
            verdict.longest = f"{scene.task.name}, {agent}, {len(text)} characters"
    return verdict


def frames(count: int, seed: int) -> Verdict:
    """Return the outcome of this number of frames, which may be refused and must not raise anything else."""
    chance = random.Random(seed)
    verdict = Verdict()
    known: dict[type, list[bytes]] = {kind: [] for kind in MESSAGE_TYPES}
    for recorded in read(GOLDEN):
        if recorded.message is not None:
            known[type(recorded.message)].append(encode(recorded.message))
    known = {kind: sorted(payloads, key=len)[:40] for kind, payloads in known.items() if payloads}
    for _ in _trials(verdict, count):
        kind = chance.choice(list(known))
        payload = _broken(chance, chance.choice(known[kind]))
        try:
            took_s = _take(kind, payload)
            if took_s > LONGEST_S:  # other processes slow the caches down
                took_s = min(took_s, *(_take(kind, payload) for _ in range(2)))
        except Exception:  # noqa: BLE001  # every one is a find
            verdict.exceptions[_where(repr(payload[:200]))] += 1
            continue
        if took_s > verdict.slowest_s:
            verdict.slowest_s = took_s
            verdict.slowest = f"{kind.__name__} of {len(payload)} bytes"
    return verdict


def _take(kind: type[Any], payload: bytes) -> float:
    began = time.process_time()
    with contextlib.suppress(PeerError):
        decode(payload)
        message = decode_as(kind, payload)
        encode(message)
        if isinstance(message, Reply):
            encode(message.but(usage=sum([message.usage] * 3, Usage())))
    return time.process_time() - began


def _broken(chance: random.Random, payload: bytes) -> bytes:
    for _ in range(chance.randrange(1, 4)):
        start = chance.randrange(len(payload) + 1)
        stop = min(len(payload), start + chance.randrange(1, 30))
        junk = bytes(chance.choices(range(256), k=chance.randrange(1, 8)))
        colon = payload.find(b":", start) + 1
        end = min((at for mark in b",}" if (at := payload.find(mark, colon)) > 0), default=colon)
        changes = (
            payload[:start] + payload[stop:],
            payload[:start] + junk + payload[stop:],
            payload[:stop] + payload[start:],
            payload[:colon] + chance.choice(VALUES).encode() + payload[end:],
            payload[:colon] + chance.choice(VALUES).encode() + payload[end:],
            payload[:start],
        )
        payload = chance.choice(changes)
    return payload


def _trials(verdict: Verdict, count: int) -> Iterator[None]:
    """Yield once for each trial, and measure all of them; memory is measured after the first tenth."""
    began = time.perf_counter()
    before_mb = 0.0
    for number in range(count):
        if number == count // 10:
            before_mb = _resident_mb()
        yield
    verdict.trials += count
    verdict.took_s = time.perf_counter() - began
    verdict.left_mb = _resident_mb() - before_mb


def _resident_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


def _where(text: str) -> str:
    last = traceback.format_exc(limit=-1).strip().splitlines()
    return f"{last[-1][:120]} at {last[1].strip()[-80:]}: {text[:80]!r}"


def run(trial: Callable[[int, int], Verdict], count: int, seed: int, processes: int) -> Verdict:
    """Return the outcome of trials in several processes, each with a seed of its own."""
    shares = [(count // processes, seed + number) for number in range(processes)]
    with multiprocessing.get_context("fork").Pool(processes) as pool:
        found = pool.starmap(trial, shares)
    whole = Verdict()
    for verdict in found:
        whole.add(verdict)
    return whole


def main() -> None:
    """Print the figures."""
    options = make_parser(__doc__)
    options.add_argument("--replies", type=int, default=100_000)
    options.add_argument("--frames", type=int, default=20_000)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--processes", type=int, default=2)
    chosen = options.parse_args()
    trials: dict[
        str, tuple[Callable[[int, int], Verdict], int]
    ] = {  # a further kind of input is one more line, and a function of a count and a seed
        "replies": (partial(replies, scenes()), chosen.replies),
        "frames": (frames, chosen.frames),
    }
    verdicts = {
        name: run(trial, count, chosen.seed, chosen.processes) for name, (trial, count) in trials.items() if count
    }
    if chosen.json:
        print(json.dumps({name: asdict(verdict) for name, verdict in verdicts.items()}))
    else:
        for name, verdict in verdicts.items():
            _print(name, verdict)
    raise SystemExit(0 if all(verdict.is_good() for verdict in verdicts.values()) else 1)


def _print(name: str, verdict: Verdict) -> None:
    rate = verdict.trials / verdict.took_s if verdict.took_s else 0
    print(f"{name}: {verdict.trials} in {verdict.took_s:.0f} s, {rate:.0f} a second")
    print(f"    slowest {verdict.slowest_s * 1000:.1f} ms: {verdict.slowest}")
    if verdict.most_growth:
        print(f"    longest next observation x{verdict.most_growth:.2f}: {verdict.longest}; forged {verdict.forged}")
    print(f"    memory {verdict.left_mb:+.1f} MB; exceptions {verdict.exceptions.total()}")
    for what, number in verdict.exceptions.most_common(20):
        print(f"        {number} {what}")
