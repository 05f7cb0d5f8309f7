"""An observation → what of it a prompt does not say already, in its system message; and back.

An observation stands by itself: it repeats the task, who may be written to, and what is known of the agent's own types,
for readers that have nothing else. A prompt has these at its front, where they are the same in each step and a provider
can cache them. What changes stays: the task of a stage, the numbers of a type that an upgrade has made better.

`khala_agents.prompt` is above.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from khala_protocol.messages import Briefing

_SECTION = re.compile(r"\n\n(?=\S)")
_BLOCK = re.compile(r"\n(?=    \S)")
_TEAM = re.compile(r"Team \S+: ")
_CHAPTER = re.compile(r"\n\n(?=# )")
_TEAM_TASK = re.compile(r"- (\S+): [^.\n]*\. (.*)")
_CONTACT = re.compile(r"- ([^\s:<]+)(?!: a channel)(?::.*)?$")
INDENT = "    "


def sections_of(observation: str) -> list[str]:
    """Return the sections of an observation, each with its heading as the first line."""
    return _SECTION.split(observation)


def chapters_of(system: str) -> list[str]:
    """Return the chapters of a system message, each with its heading as the first line."""
    return _CHAPTER.split(system)


class PromptRepeats:
    """What the prompts of an agent say in each step.

    Args:
        briefing: of the agent.
        form_apart: whether its answers have a form that is not the one of which observations speak.
    """

    def __init__(self, briefing: Briefing, *, form_apart: bool = False) -> None:
        self._tasks = {" ".join(text.split()) for text in briefing.task.splitlines()}
        self._tasks |= {" ".join(team.task.split()) for team in briefing.teams}
        self._known = frozenset(line for said in briefing.knowledge for line in said.splitlines())
        self._writers: dict[str, Callable[[str], Iterable[str]]] = {
            "Task": self._task,
            "Communication": lambda _: (),
            "Unit knowledge": self._knowledge,
        }
        if form_apart:
            self._writers["Answer"] = lambda _: ()

    def without(self, observation: str) -> str:
        """Return an observation without its repeats."""
        sections = []
        whole = observation.rstrip("\n")
        for section in sections_of(whole):
            heading, _, body = section.partition("\n")
            writer = self._writers.get(heading)
            if writer is None:
                sections.append(section)
            elif lines := list(writer(body)):
                sections.append("\n".join([heading, *lines]))
        return "\n\n".join(sections) + observation[len(whole) :]

    def _task(self, body: str) -> Iterator[str]:
        for line in body.splitlines():
            if _TEAM.sub("", line.strip(), count=1) not in self._tasks:
                yield line

    def _knowledge(self, body: str) -> Iterator[str]:
        """Yield the types with the lines that are new; the name alone stands for a line that is known."""
        for block in _BLOCK.split(body):
            heading, *more = (line.strip() for line in block.splitlines())
            new = [line for line in more if line not in self._known]
            if heading not in self._known:
                yield from (f"{INDENT}{heading}", *(f"{INDENT * 2}{line}" for line in new))
            elif new:
                name = heading.partition(":")[0]
                yield f"{INDENT}{name} now: {'; '.join(new)}"


def say_again(system: str, observation: str) -> str:
    """Return the observation of a prompt with what its system message says of the task and of whom to write to."""
    chapters = dict(chapter.partition("\n")[::2] for chapter in chapters_of(system))
    task = chapters.get("# Your task", "").splitlines()
    task += [f"Team {name}: {said}" for name, said in _TEAM_TASK.findall(chapters.get("# Your teams", ""))]
    contacts = [
        found[1] for line in chapters.get("# Communication", "").splitlines() if (found := _CONTACT.match(line))
    ]
    sections = sections_of(observation.rstrip("\n"))
    if task:
        again = "\n".join(["Task", *(f"{INDENT}{line}" for line in task)])
        stage = next((section for section in sections if section.startswith("Task\n")), "Task")
        sections = [section for section in sections if section is not stage] + [again + stage.removeprefix("Task")]
    if contacts and not any(section.startswith("Communication\n") for section in sections):
        sections.append(f"Communication\n{INDENT}You can write to: {', '.join(contacts)}")
    return "\n\n".join(sections) + "\n"
