"""A prompt that is longer than its model's context → the same prompt without the parts that matter least.

`CUTS` is the whole rule: what is left out, in which order, and why. The role, the task, the teams, the actions and the
form of an answer stay, and so do units and enemies that are near, the valid actions and the answers to the last orders.
 A prompt that is still too long then is not sent: the endpoint would refuse it, or read a part of it.

Above it is `khala_agents.llm_policy`, which knows how much room there is.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from khala_agents.llm.client import RequestRefused, estimated_tokens
from khala_agents.repeats import chapters_of, sections_of
from khala_protocol.messages import ChatMessage

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_agents.llm.vision import Vision
    from khala_protocol.messages import ImageRef


class PromptTooLong(RequestRefused):
    """A prompt does not fit its model's context, whatever is left out."""


@dataclass(frozen=True, slots=True)
class DraftPrompt:
    """The parts of a prompt.

    Attributes:
        system: the system message.
        example: a worked example: an observation and a reply.
        recalled: messages of earlier steps, the oldest first.
        summary: the agent's summary of the game.
        steps: the last steps in short.
        observation: what the agent sees now.
        refused: the agent's answer to it of which nothing is possible; "" if it was empty, is not known, or is to come.
        verdict: the host's words about that answer; "" before there is one.
        missing: which pictures did not arrive, each on a line.
        images: pictures beside the observation.
        left_out: names of the cuts that were made, in their order.
    """

    system: str
    example: tuple[ChatMessage, ...] = ()
    recalled: tuple[ChatMessage, ...] = ()
    summary: str = ""
    steps: str = ""
    observation: str = ""
    refused: str = ""
    verdict: str = ""
    missing: str = ""
    images: tuple[ImageRef, ...] = ()
    left_out: tuple[str, ...] = ()

    @property
    def stable(self) -> int:
        """Number of messages at the front that are the same in all prompts of an episode."""
        return 1 + len(self.example)

    @property
    def messages(self) -> tuple[ChatMessage, ...]:
        """The prompt."""
        unseen = [name for name in self.left_out if name in _SEEN]
        note = f"\nLeft out here, to keep this short: {', '.join(unseen)}.\n" if unseen else ""
        said = "\n".join([*filter(None, (self.summary, self.steps)), self.observation]) + note
        system = ChatMessage(role="system", content=self.system)
        content = f"{self.missing}\n{said}" if self.missing else said
        again: tuple[ChatMessage, ...] = ()
        if self.refused.strip():
            again = (
                ChatMessage(role="assistant", content=self.refused),
                ChatMessage(role="user", content=self.verdict),
            )
        elif self.verdict:
            content += f"\n\n{self.verdict}"
        seen = ChatMessage(role="user", content=content, images=self.images)
        return (system, *self.example, *self.recalled, seen, *again)

    def fit(self, room: int | None, vision: Vision | None = None) -> DraftPrompt:
        """Return the prompt with so much left out that it has at most `room` estimated tokens; None for any number.

        Raises:
            PromptTooLong: it has more tokens when all cuts are made.
        """
        draft = self.shorten(room, vision)
        if room is not None and draft.tokens(vision) > room:
            raise PromptTooLong(
                f"the prompt has about {draft.tokens(vision)} tokens when all that can be is left out, and there is "
                f"room for {room}: give the model a larger context at its server, or lower max_tokens in its file",
                status="context",
            )
        return draft

    def shorten(self, room: int | None, vision: Vision | None = None) -> DraftPrompt:
        """Return the prompt with as much left out as `fit` does, or all that can be."""
        draft = self
        if room is None or draft.tokens(vision) <= room:
            return draft
        for cut in CUTS:
            while (shorter := cut.shorten(draft)) != draft:
                draft = replace(shorter, left_out=tuple(dict.fromkeys((*shorter.left_out, cut.name))))
                if draft.tokens(vision) <= room:
                    return draft
        return draft

    def tokens(self, vision: Vision | None = None) -> int:
        """Return the estimated tokens."""
        return estimated_tokens(self.messages, vision)


@dataclass(frozen=True, slots=True)
class Cut:
    """A part that can be left out; `shorten` returns the draft itself where there is nothing of it."""

    name: str
    reason: str
    shorten: Callable[[DraftPrompt], DraftPrompt]


def _without_oldest_step(draft: DraftPrompt) -> DraftPrompt:
    left = draft.recalled[1:]
    while left and left[0].role == "assistant":  # an answer to what is left out
        left = left[1:]
    return replace(draft, recalled=left)


def _section(heading: str, reason: str) -> Cut:
    """Return the cut of a section of an observation, whose heading stands at the beginning of a line."""

    def shorten(draft: DraftPrompt) -> DraftPrompt:
        kept = [section for section in sections_of(draft.observation) if not _has_heading(section, heading)]
        return replace(draft, observation="\n\n".join(kept))

    return Cut(heading, reason, shorten)


def _of_teams(heading: str, reason: str) -> Cut:
    """Return the cut of a list that each team has."""
    block = re.compile(rf"^( +){heading}\b[^:\n]*:.*\n(?:\1 +.*(?:\n|\Z))*", re.MULTILINE)
    return Cut(heading, reason, lambda draft: replace(draft, observation=block.sub("", draft.observation)))


def _without_farthest_unit(draft: DraftPrompt) -> DraftPrompt:
    """Return the draft without the farthest unit of the longest list of a team."""
    lists = [found.span() for found in _UNITS.finditer(draft.observation)]
    longest = max(lists, key=lambda span: draft.observation.count("\n", *span), default=(0, 0))
    lines = draft.observation[slice(*longest)].splitlines(keepends=True)
    if len(lines) <= FEWEST_UNITS:
        return draft
    lines.remove(max(reversed(lines), key=_distance))
    observation = draft.observation[: longest[0]] + "".join(lines) + draft.observation[longest[1] :]
    return replace(draft, observation=observation)


def _distance(line: str) -> float:
    found = _DISTANCE.search(line)
    return float(found[1]) if found else 0.0


def _without_descriptions(draft: DraftPrompt) -> DraftPrompt:
    return replace(draft, system=_DESCRIPTIONS.sub(r"\1", draft.system))


def _manual(heading: str, reason: str) -> Cut:
    """Return the cut of a section of the system message."""

    def shorten(draft: DraftPrompt) -> DraftPrompt:
        kept = [section for section in chapters_of(draft.system) if not section.startswith(f"# {heading}\n")]
        return replace(draft, system="\n\n".join(kept))

    return Cut(f"{heading} (instructions)", reason, shorten)


def _has_heading(section: str, heading: str) -> bool:
    return section.partition("\n")[0].rstrip(":").strip() == heading


_UNITS = re.compile(r"(?:^ +\S.* \| tag 0x.*(?:\n|\Z))+", re.MULTILINE)
_DISTANCE = re.compile(r"\| distance (\d+(?:\.\d+)?)")
_DESCRIPTIONS = re.compile(r"^(- <[^>\n]*>): .*$", re.MULTILINE)
FEWEST_UNITS: Final = 2
"""Units of a list that stay."""

_OF_OBSERVATION: Final[tuple[Cut, ...]] = (
    _section("Unit knowledge", "much of it is known to a model"),
    _manual("Your units", "much of it is known to a model"),
    _section("Teams of other agents", "others command them"),
    _section("Map", "it is the same in all steps"),
    _section("Armies", "it counts what stands elsewhere one by one"),
    _section("Unit counts", "it counts what stands elsewhere one by one"),
    _section("Economy", "what can be paid is said beside the valid actions"),
    _section("Places to build at", "the host finds a place for a structure that names none"),
    _section("Not possible now", "the refusal of such an action says why"),
    _of_teams("Allied units", "others command them; their enemies and the agent's own units stay"),
    _of_teams("Since the last observation", "what is there now stands elsewhere"),
    _section("Since the last observation", "what is there now stands elsewhere"),
    _section("Alerts", "what is there now stands elsewhere"),
    _section("Messages", "orders can be given without them"),
)
_FAR_UNITS: Final = "the farthest units"
_PICTURES: Final = "pictures"
_SEEN: Final = frozenset({_FAR_UNITS, _PICTURES, *(cut.name for cut in _OF_OBSERVATION)})
"""Parts that an agent must not believe to be empty."""

CUTS: Final[tuple[Cut, ...]] = (
    Cut("earlier steps", "the observation says what became of the last orders", _without_oldest_step),
    Cut(
        "steps in short", "the observation says what became of the last orders", lambda draft: replace(draft, steps="")
    ),
    Cut("summary of the game", "it is of the past", lambda draft: replace(draft, summary="")),
    Cut("worked example", "the system message says the form in words", lambda draft: replace(draft, example=())),
    Cut(_PICTURES, "most of what they show is in the text", lambda draft: replace(draft, images=())),
    *_OF_OBSERVATION,
    _manual("Standing orders", "orders can be given one by one"),
    _manual("Memory", "orders can be given without notes"),
    _manual("Communication", "orders can be given without messages"),
    _of_teams("What they cost", "what cannot be paid is not among the valid actions"),
    _section("Answer", "the system message has it, too"),
    Cut("descriptions of actions", "their names and arguments stay", _without_descriptions),
    _manual("Rules", "a refusal names the rule that was broken"),
    Cut(
        _FAR_UNITS,
        "of the longest list, one after the other; near ones matter first",
        _without_farthest_unit,
    ),
)
"""What is left out of a prompt that is too long, in this order; of earlier steps the oldest first."""
