"""Turn a recording into a transcript for a person: what was seen, said and done, step by step.

It reads the file once, in order, and holds at most one step of it.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from rich.text import Text

from khala_orchestrator.console import card, clock, side, speaker, style_of, table, two_sides, visible_message
from khala_orchestrator.roster import Seat
from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.files import make_private, write_private
from khala_protocol.messages import (
    AgentReport,
    ImageRef,
    Message,
    Observation,
    Reply,
    Report,
    Result,
    Run,
    Scene,
    Terrain,
)
from khala_protocol.recording import Recording, read
from khala_protocol.visible import visible_line

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from rich.console import RenderableType

    from khala_protocol.messages import Wire


_NOT_IN_FILE_NAMES = re.compile(r"[^A-Za-z0-9_.-]+")  # a recording may be anyone's, and its names too


@dataclass(frozen=True, slots=True)
class StepSelection:
    """Which part of a recording is shown."""

    agent: str | None = None
    """Its name, or that and the name of its side: `red/Captain`."""
    first: int = 0
    last: int | None = None

    @classmethod
    def of(cls, agent: str | None, steps: str | None) -> Self:
        """Return the selection of the command line; `steps` is `7`, `10-20`, `10-` or `-20`.

        Raises:
            ConfigError: `steps` is none of these.
        """
        if steps is None:
            return cls(agent)
        found = re.fullmatch(r"([0-9]{0,9})(?:(-)([0-9]{0,9}))?", steps)
        if not found or not steps.strip("-"):
            raise ConfigError(f"{steps[:40]!r} does not name steps: write 7, 10-20, 10- or -20", source="--steps")
        first, dash, last = found.groups()
        end = last if dash else first
        return cls(agent, int(first or 0), int(end) if end else None)

    @property
    def side(self) -> str | None:
        """The side of its agent; None for any."""
        return self.agent.partition("/")[0] if self.agent and "/" in self.agent else None

    def holds(self, step: int, seat: Seat | None = None) -> bool:
        """Return whether a step belongs to it, and an agent, if one is given."""
        in_time = step >= self.first and (self.last is None or step <= self.last)
        return in_time and (seat is None or self.agent in {None, seat.agent, str(seat)})


def transcript(path: Path, selection: StepSelection, *, whole: bool = False) -> Iterator[RenderableType]:
    """Yield the printed form of a recording, in its order.

    Args:
        path: the recording.
        selection: which part.
        whole: also show observations and replies word for word.

    Raises:
        RecordingError: the file is not a recording.
    """
    named = False
    for recorded in read(path):
        if recorded.is_of(Terrain, Scene):
            continue
        match recorded.message and visible_message(recorded.message):
            case Run() as run:
                named = two_sides(run)
                yield card(run)
            case Result() as result:
                yield table(result, named=named)
            case Observation() as seen if whole and selection.holds(seen.step, _seat(seen)):
                heard = " is told" if seen.verdict else " sees"
                title = Text.assemble(f"step {seen.step}, ", _speaker(seen, named=named), heard)
                yield _quotation(title, seen.verdict.text if seen.verdict else seen.text, "cyan")
                if seen.verdict:
                    continue
                yield from (_picture(image) for image in seen.images)
            case Reply() as reply if whole and selection.holds(reply.step, _seat(reply)):
                title = Text.assemble(f"step {reply.step}, ", _speaker(reply, named=named), " says")
                yield _quotation(title, reply.text, "magenta")
            case Message() as said if selection.holds(said.step, _seat(said)):
                words = (f"{' (human)' if said.human else ''} → {visible_line(said.recipient)}: ", "magenta")
                yield Text.assemble("  ", _speaker(said, named=named), words, visible_line(said.text))
            case Report() as report if selection.holds(report.step):
                yield from _report(report, selection, named=named)


def summary(path: Path, selection: StepSelection) -> dict[str, Any]:
    """Return the run card, the results and the reports of a recording, as JSON data."""
    found: dict[str, list[Wire]] = {"run": [], "result": [], "report": []}
    topics: Counter[str] = Counter()
    for recorded in read(path):
        topics[recorded.key] += 1
        message = recorded.message if recorded.is_of(Run, Result, Report) else None
        if isinstance(message, Run | Result) or (isinstance(message, Report) and selection.holds(message.step)):
            found[message.kind].append(message)
    plain = {kind: [message.model_dump(mode="json") for message in messages] for kind, messages in found.items()}
    return {
        "run": plain["run"][0] if plain["run"] else None,
        "results": plain["result"],
        "reports": plain["report"],
        "samples": dict(sorted(topics.items())),
    }


def _report(report: Report, selection: StepSelection, *, named: bool) -> Iterator[Text]:
    if selection.side not in {None, report.side}:
        return
    whose = Text.assemble(side(report.side), "  ") if named else Text()
    held = f"  held for {report.timings.held_s:.1f} s" if report.timings.held_s else ""
    yield Text.assemble(
        f"step {report.step}  {clock(report.game_loop)}  ", whose, f"score {report.score:g}", held, style="bold"
    )
    for agent in report.agents:
        if selection.holds(report.step, _seat(agent)):
            yield from _agent(agent, named=named)


def _agent(agent: AgentReport, *, named: bool) -> Iterator[Text]:
    latency = "" if agent.latency_s is None else f" after {agent.latency_s * 1000:.0f} ms"
    ignored = f", {agent.ignored} ignored" if agent.ignored else ""
    rethinks = f", asked to rethink {agent.rethinks}×" if agent.rethinks else ""  # noqa: RUF001  # times
    why = ": ".join(filter(None, (agent.detail, agent.reason)))
    detail = f" ({visible_line(why)})" if why else ""
    status = (agent.status, style_of(agent.status))
    who = Text.assemble(_speaker(agent, named=named), " (human)" if agent.human else "")
    yield Text.assemble("  ", who, ": ", status, f"{detail}{latency}{rethinks}{ignored}")
    yield from (Text(f"    {call}", "green") for call in agent.accepted)
    for fault in agent.rejections:
        kind = f" ({fault.hallucination.replace('_', '-')})" if fault.hallucination else ""
        yield Text.assemble(
            (f"    {visible_line(fault.text)}", "red"), f"  {fault.reason}{kind}: {visible_line(fault.message)}"
        )


def _seat(said: AgentReport | Message | Observation | Reply) -> Seat:
    return Seat(said.side, said.agent)


def _speaker(said: AgentReport | Message | Observation | Reply, *, named: bool) -> Text:
    return speaker(_seat(said), named=named)


def save_pictures(path: Path, selection: StepSelection, directory: Path) -> list[Path]:
    """Write the pictures that agents were shown into a directory, and return their files.

    Args:
        path: the recording.
        selection: which part.
        directory: is created if missing; files are named after step, agent and picture.

    Raises:
        RecordingError: the file is not a recording, or the directory cannot be written.
    """
    recording = Recording.open(path)
    pictures = dict(recording.images())
    saved = []
    try:
        make_private(directory)
        for seen in recording.of(Observation):
            if not selection.holds(seen.step, _seat(seen)):
                continue
            agent = str(_seat(seen)) if two_sides(recording.run) else seen.agent
            for image in seen.images:
                if image.sha256 in pictures:
                    kind = image.media_type.partition("/")[2]
                    name = f"{seen.episode}-{seen.step:04}-{agent}-{image.name}"
                    saved.append(directory / f"{_NOT_IN_FILE_NAMES.sub('_', name)[:200]}.{kind}")
                    write_private(saved[-1], pictures[image.sha256])
    except OSError as error:
        raise RecordingError(f"{directory} cannot be written: {error.strerror}") from None
    return saved


def _picture(image: ImageRef) -> Text:
    kind = image.media_type.partition("/")[2].upper()
    size = f"{image.width} x {image.height} {kind}, {image.bytes / 1000:.0f} kB"
    return Text.assemble(("  picture ", "bold cyan"), f"{image.name} ({size}): ", (image.title, "dim"))


def _quotation(title: Text, text: str, style: str) -> Text:
    body = "\n".join(f"  │ {line}" for line in text.splitlines())
    title.style = f"bold {style}"
    return Text.assemble(title, "\n", (body, "dim"))
