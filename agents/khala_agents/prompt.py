"""A briefing and an observation → the messages of a prompt.

All that stays the same during an episode is put together once and stands at the front, word for word the
same in each step, so that a provider can cache it: the agent's role, its task, its teams, its actions
and their form, how to answer, and a worked example: the host's, or one made of the agent's own teams and
actions. The messages that the memory recalls follow, and the observation as the host wrote it; above it in the same
message stand the summary of the game, which changes rarely, and the last steps.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from khala_agents.answers.wording import (
    EXAMPLE_POINTS,
    GOES_ON,
    how_to_answer_in_json,
    how_to_answer_with_tools,
    in_json,
)
from khala_agents.detail import DETAILS
from khala_agents.fitting import DraftPrompt
from khala_agents.repeats import PromptRepeats
from khala_protocol import manual
from khala_protocol.messages import LOOPS_PER_S, ChatMessage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from khala_agents.answers.form import AnswerForm
    from khala_agents.detail import Detail
    from khala_protocol.messages import (
        ActionSpec,
        AgentKind,
        Briefing,
        Clock,
        Contact,
        Frames,
        ImageRef,
        MemoryRule,
        TeamSpec,
    )

EXAMPLE_TAGS = ("0xe0001", "0xe0002")
"""Tags of the example; a game's own tags are longer, so that a copied one is noticed at once."""


class Prompt:
    """The prompts of one episode.

    Args:
        briefing: of the agent.
        form: of its answers. With `tools` there is no example: an answer in words would teach the wrong form.
        detail: how much prompts say.
    """

    def __init__(self, briefing: Briefing, form: AnswerForm = "text", detail: Detail = "full") -> None:
        seen, said = _example(briefing)
        example = (
            ChatMessage(role="user", content=seen),
            ChatMessage(role="assistant", content=in_json(said, briefing.actions) if form == "json" else said),
        )
        self._draft = DraftPrompt(system_text(briefing, form), () if form == "tools" else example)
        self._room = DETAILS[detail]
        self._repeats = PromptRepeats(briefing, form_apart=form in ("json", "tools"))

    @property
    def stable(self) -> int:
        """Number of messages at the front that are the same in all of them."""
        return self._draft.stable

    @property
    def example(self) -> tuple[ChatMessage, ...]:
        """The worked example, an observation and an answer to it; empty with `tools`."""
        return self._draft.example

    def messages(self, observation_text: str, recalled: Sequence[ChatMessage] = ()) -> tuple[ChatMessage, ...]:
        """Return the system message, the example, what the memory recalls, and the observation."""
        return self.draft(observation_text, recalled=tuple(recalled)).messages

    def draft(
        self,
        observation_text: str,
        *,
        recalled: tuple[ChatMessage, ...] = (),
        summary: str = "",
        steps: str = "",
        images: tuple[ImageRef, ...] = (),
        missing: Sequence[ImageRef] = (),
    ) -> DraftPrompt:
        """Return a prompt that can be made shorter; its observations do not repeat what the system message says.

        Args:
            observation_text: as the host wrote it.
            recalled: messages of earlier steps.
            summary: of the game.
            steps: the last ones in short.
            images: pictures to show, each with its title before it.
            missing: pictures that did not arrive; the prompt says so.
        """
        lost = "".join(f"Not shown, for it did not arrive: {_line(image.title or image.name)}\n" for image in missing)
        whole = replace(
            self._draft,
            observation=self._repeats.without(observation_text),
            recalled=tuple(map(self._shown_again, recalled)),
            summary=summary,
            steps=steps,
            images=images,
            missing=lost,
        )
        return whole.shorten(self._room)

    def _shown_again(self, message: ChatMessage) -> ChatMessage:
        if message.role != "user":
            return message
        return message.model_copy(update={"content": self._repeats.without(message.content)})


def _line(text: str) -> str:
    return " ".join(text.split())


def system_text(briefing: Briefing, form: AnswerForm = "text") -> str:
    """Return the part of a prompt that says everything except what the agent sees."""
    most = briefing.standing_orders
    in_text = form in ("text", "grammar")
    can_stand = most and in_text and briefing.teams
    sections = (
        ("Who you are", _identity(briefing)),
        ("Your task", briefing.task),
        ("Your teams", _teams(briefing.teams)),
        ("Your units", _knowledge(briefing.knowledge)),
        ("Rules", _rules(briefing)),
        ("Actions", manual.list_actions(briefing.actions)),
        ("Arguments", _arguments(briefing.actions, briefing.frames)),
        ("Communication", _communication(briefing.correspondents, briefing.channels, in_text=in_text)),
        ("Memory", _memory(briefing.memory, in_text=in_text)),
        ("Standing orders", manual.standing_orders(briefing.actions, most) if can_stand else ""),
        ("How to answer", _HOW_TO_ANSWER[form](briefing)),
    )
    return "\n\n".join(f"# {title}\n{text}" for title, text in sections if text)


def _identity(briefing: Briefing) -> str:
    return f"You are {briefing.agent}, one of the agents that play a game of StarCraft II.\n{briefing.role}".rstrip()


def _teams(teams: Iterable[TeamSpec]) -> str:
    return "\n".join(
        f"- {team.name}: {', '.join(team.unit_types) or _OF_SIDE}" + (f". {team.task}" if team.task else "")
        for team in teams
    )


_OF_SIDE = "no units of its own; units of your whole side carry out its actions"


def _knowledge(types: Iterable[str]) -> str:
    return "\n".join("- " + "\n  ".join(said.splitlines()) for said in types)


def _rules(briefing: Briefing) -> str:
    number = briefing.max_actions
    rules = [
        "You command your own teams only.",
        "Units that the latest observation does not list are out of sight or dead.",
        *_RULES[briefing.agent_kind],
        f"A team carries out at most {number} of your actions a step, one after the other; more are refused.",
        *([_ALONE] if any(action.name.startswith("Select_Unit_") for action in briefing.actions) else []),
        "Your next observation says which actions were refused, and why.",
        _clock(briefing.clock),
    ]
    return "\n".join(f"- {rule}" for rule in rules)


_ALONE = "An action for a single unit takes it out of the actions of its team in the same answer."
_RULES: dict[AgentKind, tuple[str, ...]] = {
    "combat_group": (
        "Many weapons on one enemy kill it sooner, and a dead enemy no longer shoots: concentrate fire.",
        "Fight where you gain more than you lose; pull out units that are about to die for nothing.",
        "Abilities that help now come before moving and attacking.",
    ),
    "commander": (
        "One strong army beats two weak ones: gather first, then attack together.",
        "Attack when your army is worth more than what was seen of the enemy's, and come home when it is not.",
        "What was seen long ago may have moved: send scouts before you decide.",
        "Say in a message who does what, where, and until when; use the names of places and their points.",
    ),
    "developer": (
        "Minerals in the bank win no game: spend what comes in, and add production when you cannot.",
        "Order supply before it is short, workers until every base is full, and army units all the time.",
        "Build what beats the units that the enemy was seen to have.",
        "Write to others only what you have ordered or what they must know.",
    ),
    "builder": (
        "Build only what can be paid now; each structure needs free ground, and most need power or creep.",
        "Keep the ways between town halls and minerals free, and leave gaps for units to pass.",
        "Build nearest to what the structure is for: supply at home, defence in front, bases at free places.",
    ),
}
"""What each kind of agent should know of its work."""


def _clock(clock: Clock) -> str:
    between_s, thinking_s = clock.step_loops / LOOPS_PER_S, clock.thinking_loops / LOOPS_PER_S
    answer = (
        "" if clock.max_wait_s is None else f" Answer within {clock.max_wait_s:g} s, or your teams go on as before."
    )
    match clock.rule:
        case "frozen":
            between = f"{between_s:.2g} s of game time pass between two observations"
            return f"The game stands still while you think; {between}.{answer}"
        case "budget":
            later = f"your actions are carried out {thinking_s:.2g} s of game time after what you see"
            return f"Each decision costs the same game time however long you think: {later}.{answer}"
        case "token":
            return f"The more you write, the more game time passes before your actions are carried out.{answer}"
        case "realtime":
            return f"The game goes on while you think, and your actions meet what is there then: be brief.{answer}"


def _arguments(actions: Iterable[ActionSpec], frames: Frames) -> str:
    used = {argument for action in actions for argument in action.args}
    meanings = {
        "tag": "the tag of a unit as the observation gives it, with 0x in front",
        "screen": f"a point [x, y] near the team that acts, x and y from 0 to {frames.screen:g} "
        f"with the team's screen centre at {frames.screen / 2:g}; x grows to the right, y grows downwards",
        "minimap": f"a point [x, y] of the whole map, x and y from 0 to {frames.minimap:g}; "
        "x grows to the right, y grows downwards",
    }
    return "\n".join(f"- {name}: {meaning}" for name, meaning in meanings.items() if name in used)


def _communication(correspondents: Sequence[Contact], channels: Sequence[str], *, in_text: bool) -> str:
    if not correspondents and not channels:
        return ""
    lines = [f"- {who.name}" + (f": {_first_sentence(who.role)}" if who.role else "") for who in correspondents]
    lines += [f"- {channel}: a channel, heard by all who listen to it" for channel in channels]
    if in_text:
        lines += [manual.MESSAGE, manual.LISTEN] if channels else [manual.MESSAGE]
    return "\n".join(lines)


def _first_sentence(text: str) -> str:
    return " ".join(text.split()).partition(". ")[0].removesuffix(".")


def _memory(rule: MemoryRule, *, in_text: bool) -> str:
    lines = []
    if rule.notes and in_text:
        lines += [manual.NOTE, manual.FORGET.format(notes=rule.notes)]
    if rule.messages_s:
        lines += [
            f"A message to you is shown for {rule.messages_s:g} s of game time, or until you write to its sender."
        ]
    return "\n".join(lines)


def _format(briefing: Briefing) -> str:
    lines = ['Write "Analysis:" and a few sentences on what matters now.']
    if not briefing.teams:
        return "\n".join([*lines, 'Then write "Communications:" and your messages: you have no team to order.'])
    lines += [
        'Then write "Actions:", and under it a line "Team <name>:" for each team that shall act, named as observed.',
        "Below it write the actions of that team, each as <Name(arguments)> on a line of its own.",
        GOES_ON,
    ]
    if briefing.correspondents or briefing.channels:
        lines.append('If you have something to say to others, end with "Communications:" and the messages.')
    return "\n".join(lines)


_HOW_TO_ANSWER: Mapping[AnswerForm, Callable[[Briefing], str]] = {
    "text": _format,
    "grammar": _format,
    "json": how_to_answer_in_json,
    "tools": how_to_answer_with_tools,
}


def _example(briefing: Briefing) -> tuple[str, str]:
    """Return an observation and a reply: the host's worked example, or one of the form alone."""
    if briefing.example is None:
        return _example_observation(briefing), _example_reply(briefing)
    return f"{_NOT_THIS_GAME}\n\n{briefing.example.observation}", briefing.example.reply


_NOT_THIS_GAME = (
    "This is an example of an observation and an answer, not a situation of this game. Its tags and points mean "
    "nothing later on."
)


def _example_observation(briefing: Briefing) -> str:
    names = " and ".join(_example_teams(briefing))
    return (
        f"This is an example of the form of an answer, not a situation of this game. Suppose that {names} had units, "
        f"that the enemy units {' and '.join(EXAMPLE_TAGS)} stood before them, and that all actions were possible. "
        "The tags and points of the example mean nothing later on."
    )


def _example_reply(briefing: Briefing) -> str:
    lines = [
        "Analysis: Two enemies are in reach and the first one is weaker. All fire on it, then on the other.",
        "Actions:",
    ]
    for team, actions in _example_teams(briefing).items():
        lines.append(f"    Team {team}:")
        lines += [f"        {_example_call(action)}" for action in actions]
    if briefing.correspondents:
        first = briefing.correspondents[0].name
        lines += ["Communications:", f"    <MessageTo({first}, '''We fire on {EXAMPLE_TAGS[0]} first.''')>"]
    return "\n".join(lines)


def _example_teams(briefing: Briefing) -> dict[str, list[ActionSpec]]:
    """Return up to two teams, with up to two actions each, that show as many kinds of arguments as possible."""
    teams = [team.name for team in briefing.teams[:2]] or [briefing.agent]
    kinds: dict[tuple[str, ...], ActionSpec] = {}
    for action in briefing.actions:
        kinds.setdefault(action.args, action)
    shown = sorted(kinds.values(), key=lambda action: len(action.args) != 1)
    count = min(2, briefing.max_actions)
    return {team: shown[index : index + count] or shown[:count] for index, team in enumerate(teams)}


def _example_call(action: ActionSpec) -> str:
    tags = iter(EXAMPLE_TAGS)
    values = [next(tags) if kind == "tag" else str(EXAMPLE_POINTS[kind]) for kind in action.args]
    return f"<{action.name}({', '.join(values)})>"
