"""Fork a recorded match: the recorded decisions up to a step, and from there on those of other agents.

A fork is a match of one episode that others go on with: `write_beginning` copies the recorded episode up to the step,
as the recording of a match of its own, and `khala_orchestrator.past.resume` plays it again, compares every observation,
and asks live agents from there on. So a fork's recording is a whole one, which is replayed and forked like any other.
Advice is added to the copy, in the step before: agents find it in the first observation that they decide on.

Above it: `khala_sc2.fork`.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_orchestrator.config import change
from khala_orchestrator.match.cards import versions
from khala_orchestrator.match.provenance import code_sha256, hardware
from khala_orchestrator.past.replay import recorded_config
from khala_orchestrator.past.resume import plays_the_same_twice
from khala_orchestrator.words.mailbox import EVERYONE, MAX_MESSAGES
from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.keys import Topic, agent_key, run_key
from khala_protocol.messages import (
    MAX_ADVICE_CHARACTERS,
    Briefing,
    Forked,
    MemoryRule,
    Message,
    ModelCall,
    Observation,
    Received,
    Report,
    Result,
    Run,
)
from khala_protocol.recording import Recorder

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import Wire
    from khala_protocol.recording import Recorded, Recording


class ForkError(RecordingError):
    """A recorded match cannot be forked, or not at this step."""


@dataclass(frozen=True)
class Trunk:
    """A recorded episode that can be forked.

    Attributes:
        config: of a match of this episode alone.
        loops: by step, the game loop after it.
        results: of the episode, one for each side; none if it was not played to its end.
        sha256: of the recording.
    """

    recording: Recording
    config: MatchConfig
    episode: int
    loops: Sequence[int]
    results: Sequence[Result]
    sha256: str

    def loop_at(self, step: int) -> int:
        """Return the game loop at which a step is decided."""
        return self.loops[step - 1] if step else 0

    def check(self, step: int) -> None:
        """Check that there is a step.

        Raises:
            ForkError: there is none.
        """
        if not 0 <= step < len(self.loops):
            raise ForkError(
                f"{self.recording.path} has the steps 0 to {len(self.loops) - 1} of episode {self.episode}: "
                f"it cannot be forked at step {step}"
            )

    def fork(self, step: int, run: str, *, memory: str | None = None) -> MatchConfig:
        """Return the match that is forked at a step.

        Args:
            step: the first one that others decide.
            run: name of the fork.
            memory: a rule for what prompts have of the steps before; None: as recorded.

        Raises:
            ForkError: there is no such step.
            ConfigError: the rule is wrong, or changes what was seen before the step.
        """
        self.check(step)
        forked = Forked(run=self.config.run, sha256=self.sha256, episode=self.episode, step=step)
        changes = {"run": run, "forked": forked, "task": _with_memory(self.config.task, memory)}
        return self.config.model_copy(update=changes)


def trunk_of(recording: Recording, episode: int = 0) -> Trunk:
    """Return a recorded episode that can be forked.

    Raises:
        ForkError: its game does not play the same twice, or the episode has no complete step.
        RecordingError: it has no run card, or not all decisions.
    """
    config = recorded_config(recording)
    if not plays_the_same_twice(config):
        raise ForkError(
            f"{recording.path} was played on {config.game}, which does not play the same game twice: only matches on "
            "the simulator can be forked"
        )
    if not config.task.clock.waits:
        raise ForkError(
            f"{recording.path} was played with the clock realtime, where the time of a reply matters, so "
            "its forks could not be compared; play the match with --clock token, which counts tokens instead"
        )
    loops = _loops(recording, episode, sides=len(config.task.per_side()))
    if not loops:
        raise ForkError(f"{recording.path} has no complete step of episode {episode}")
    results = [result for result in recording.results if result.episode == episode and result.outcome != "aborted"]
    with recording.path.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    alone = config.model_copy(update={"seed": config.seed + episode, "episodes": 1, "labels": {}})
    return Trunk(recording, alone, episode, loops, results, sha256)


def _loops(recording: Recording, episode: int, *, sides: int) -> list[int]:
    """Return the game loop after each step of which every side has a report, as the last one of a torn file may not."""
    reports = [report.game_loop for report in recording.of(Report) if report.episode == episode]
    return reports[sides - 1 :: sides]


def _with_memory(task: TaskConfig, memory: str | None) -> TaskConfig:
    if memory is None:
        return task
    changed = change(task, memory=memory)
    if kept := MemoryRule.model_validate(memory).model_fields_set & {"notes", "messages_s"}:
        raise ConfigError(
            f"{' and '.join(sorted(kept))} would change what agents saw before the step: a fork may change steps, "
            "whole and summary",
            source="--memory",
        )
    return changed


# --- advice -----------------------------------------------------------------------------------------


def advice_of(config: MatchConfig, texts: Iterable[str]) -> list[Message]:
    """Return what `RECIPIENT: TEXT` or `SIDE/RECIPIENT: TEXT` says to agents of a fork, in the step before it.

    Raises:
        ConfigError: one is not written so, nobody may advise, or there is no such recipient or step.
    """
    assert config.forked is not None
    found = [_advice(config, text) for text in texts]
    if found and config.forked.step == 0:
        raise _wrong_advice("no step comes before step 0, in which advice could arrive: fork at step 1 or later")
    if any(sum(message.side == other.side for other in found) > MAX_MESSAGES for message in found):
        raise _wrong_advice(f"an adviser has {MAX_MESSAGES} messages in a step")
    return found


def _advice(config: MatchConfig, said: str) -> Message:
    whom, colon, text = (part.strip() for part in said.partition(":"))
    if not (whom and colon and text):
        raise _wrong_advice(f"{said!r} names no recipient and what to say: write 'Commander: attack now'")
    if len(text) > MAX_ADVICE_CHARACTERS:
        raise _wrong_advice(f"a message has at most {MAX_ADVICE_CHARACTERS} characters")
    name, slash, recipient = whom.partition("/")
    sides = [task for task in config.task.per_side() if not slash or task.side == name]
    recipient = recipient if slash else name
    reached = [task for task in sides if recipient in _recipients(task)]
    if len(reached) != 1:
        names = ", ".join(name for task in sides for name in _recipients(task))
        is_it = f"in both sides there is one: write {sides[0].side}/{recipient}" if reached else f"there are {names}"
        raise _wrong_advice(f"there is no single {whom!r} to advise: {is_it}")
    (task,) = reached
    if not task.advisers:
        raise _wrong_advice(f"the task lets nobody advise side {task.side}")
    assert config.forked is not None
    return Message(
        run=config.run,
        agent=task.advisers[0].name,
        side=task.side,
        episode=0,
        step=max(config.forked.step - 1, 0),
        recipient=recipient,
        text=text,
        human=True,
    )


def _recipients(task: TaskConfig) -> list[str]:
    return [*(agent.name for agent in task.agents), *task.channels, EVERYONE]


def _wrong_advice(words: str) -> ConfigError:
    return ConfigError(words, source="--advise")


# --- the copy ---------------------------------------------------------------------------------------


def write_beginning(recording: Recording, config: MatchConfig, path: Path, advice: Sequence[Message] = ()) -> None:
    """Write what a fork has of the recording that it was forked from, as the beginning of its own.

    Args:
        recording: of the other match.
        config: of the fork.
        path: a file that is not there yet.
        advice: what `advice_of` returned.
    """
    forked = config.forked
    assert forked is not None
    _write(recording, config, path, forked.episode, forked.step, advice)


def write_whole(trunk: Trunk, path: Path) -> None:
    """Write a recorded episode as the recording of a match of its own, to its end."""
    _write(trunk.recording, trunk.config, path, trunk.episode, None, ())


def _write(
    recording: Recording, config: MatchConfig, path: Path, episode: int, until: int | None, advice: Sequence[Message]
) -> None:
    assert recording.run is not None
    card = recording.run.but(
        run=config.run,
        seed=config.seed,
        episodes=1,
        forked=config.forked,
        versions=versions(),
        code_sha256=code_sha256(),
        hardware=hardware(),
        labels={},
        config=config.task.model_dump(mode="json"),
    )
    sides = len(config.task.per_side())
    with Recorder(path) as recorder:
        recorder.write(run_key(config.run, Topic.RUN), encode(card))
        for sample in _samples(recording, episode, until, sides):
            message = sample.message
            if isinstance(message, Report) and until is not None and message.step == until - 1:
                heard = [advised for advised in advice if advised.side == message.side]
                for advised in heard:
                    key = agent_key(config.run, advised.side, advised.agent, Topic.MESSAGE)
                    recorder.write(key, encode(advised), log_time_ns=sample.log_time_ns)
                message = _having_heard(message, heard)
            payload = sample.payload if message is None else encode(_rename(message, config.run))
            recorder.write(_key(sample.key, config.run), payload, log_time_ns=sample.log_time_ns)


def _samples(recording: Recording, episode: int, until: int | None, sides: int) -> Iterator[Recorded]:
    """Yield the samples of an episode but its run card, up to the last report before step `until`.

    What models were asked for these steps is among them, although it may be written later.
    """
    at = -1
    left = 0 if until == 0 else sides
    for sample in recording:
        message = sample.message
        if isinstance(message, Briefing | Observation | Report | Result):
            at = max(at, message.episode)
        if isinstance(message, Run) or getattr(message, "episode", at) != episode:
            continue
        if left or (isinstance(message, ModelCall) and until is not None and message.step < until):
            yield sample
        if isinstance(message, Report) and until is not None and message.step == until - 1:
            left -= 1


def _having_heard(report: Report, advice: Sequence[Message]) -> Report:
    received = (Received(sender=message.agent, recipient=message.recipient, text=message.text) for message in advice)
    return report.but(
        messages=(*report.messages, *received), advisers=(*report.advisers, *(message.agent for message in advice))
    )


def _rename(message: Wire, run: str) -> Wire:
    """Return a message as it would be in a match of one episode under this name."""
    changes: dict[str, object] = {"run": run}
    if hasattr(message, "episode"):
        changes["episode"] = 0
    if hasattr(message, "episodes"):
        changes["episodes"] = 1
    return message.but(**changes)


def _key(key: str, run: str) -> str:
    root, _, rest = key.split("/", 2)
    return f"{root}/{run}/{rest}"
