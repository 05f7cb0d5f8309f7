"""The order of a match: what is asked, what comes of the words, and who hears it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import pytest

from khala_orchestrator.match.match import Match, SilentObserver, Stopwatch
from khala_orchestrator.match.side import sides_of
from khala_orchestrator.match.turn import Answer, Answers
from khala_orchestrator.roster import Seat
from khala_protocol.messages import Briefing, Message, Received, Reply, Report, Result, Timings, Usage

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterable

    from khala_bridge.game.game import Sides
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.match.match import MatchObserver
    from khala_orchestrator.match.turn import Question
    from khala_protocol.messages import Observation, ReplyStatus
    from tests.orchestrator.conftest import StillGame

    MakeConfig = Callable[..., MatchConfig]
    MakeGame = Callable[..., StillGame]
    Start = Callable[[StillGame], Awaitable[Sides]]
    Play = Callable[..., Awaitable["Played"]]

CLOCK = "jumps"

RUN = "test"
ATTACK = "Actions:\nTeam Stalker-1:\n<Attack_Unit(0xb)>"


@dataclass
class Pool:
    """An `AgentPool` of agents that say what a script says: by agent and step, else nothing."""

    script: dict[tuple[str, int], str | Answer]
    asked: list[Observation] = field(default_factory=list)
    pictures: list[tuple[bytes, ...]] = field(default_factory=list)

    async def ask(self, questions: Iterable[Question], *, wait: bool = True) -> Answers:
        answers = {}
        for seen, pictures in questions:
            self.asked.append(seen)
            self.pictures.append(tuple(pictures))
            found = self.script.get((seen.agent, seen.step), "")
            answers[Seat(seen.side, seen.agent)] = self._said(seen, found) if isinstance(found, str) else found
        return Answers(answers, publish_s=0.25, wait_s=0.5, held_s=0.125)

    def _said(self, seen: Observation, text: str) -> Answer:
        reply = Reply(
            run=RUN, side=seen.side, agent=seen.agent, episode=seen.episode, step=seen.step, text=text,
            usage=Usage(requests=1),
        )  # fmt: skip
        return Answer("ok", reply, latency_s=1.5)

    def of(self, agent: str) -> list[Observation]:
        return [seen for seen in self.asked if seen.agent == agent]


def _match(config: MatchConfig, game: Sides, agents: Pool, match_observer: MatchObserver) -> Match:
    return Match(config, game, sides_of(config), agents, match_observer)


@dataclass
class Ear:
    """A `MatchObserver` that keeps all it hears."""

    heard: list[Briefing | Message | Report | Result] = field(default_factory=list)

    async def brief(self, briefing: Briefing) -> None:
        self.heard.append(briefing)

    async def message(self, message: Message) -> None:
        self.heard.append(message)

    async def report(self, report: Report) -> None:
        self.heard.append(report)

    async def result(self, result: Result) -> None:
        self.heard.append(result)

    @property
    def reports(self) -> list[Report]:
        return [heard for heard in self.heard if isinstance(heard, Report)]


@dataclass
class Played:
    pool: Pool
    ear: Ear
    results: list[Result]


@pytest.fixture
def play(config: MakeConfig, start: Start, still_game: MakeGame) -> Play:
    async def run(
        script: dict[tuple[str, int], str | Answer], *, after: dict[int, dict[str, Any]] | None = None, **changes: Any
    ) -> Played:
        pool, ear = Pool(script), Ear()
        match = _match(config(**changes), await start(still_game(after=after or {})), pool, ear)
        return Played(pool, ear, [result async for result in match.play()])

    return run


async def test_a_match_speaks_in_the_order_in_which_it_plays(play: Play) -> None:
    played = await play({("Zealots", 1): "<MessageTo(Stalkers, 'go')>"}, max_steps=2, episodes=2)
    kinds = [type(heard) for heard in played.ear.heard]
    assert kinds == [Briefing, Briefing, Report, Message, Report, Result] * 2
    briefings = [heard for heard in played.ear.heard if isinstance(heard, Briefing)]
    assert [(b.agent, b.episode) for b in briefings] == [(a, e) for e in (0, 1) for a in ("Stalkers", "Zealots")]
    assert [result.episode for result in played.results] == [0, 1]


async def test_every_agent_is_asked_in_every_step_with_what_it_has_to_know(play: Play) -> None:
    played = await play({}, max_steps=2, episodes=2, max_wait_s=7.5)
    asked = [(seen.episode, seen.step, seen.agent, seen.game_loop) for seen in played.pool.asked]
    assert asked == [
        (episode, step, agent, 11 * step) for episode in (0, 1) for step in (0, 1) for agent in ("Stalkers", "Zealots")
    ]
    assert {(seen.run, seen.side, seen.answer_within_s) for seen in played.pool.asked} == {(RUN, "blue", 7.5)}
    assert [team.name for team in played.pool.of("Stalkers")[0].view.teams] == ["Stalker-1"]
    assert "Stalker" in played.pool.of("Stalkers")[0].text


async def test_pictures_go_with_the_observation_that_names_them(play: Play) -> None:
    played = await play({}, max_steps=1, images="minimap, screen")
    for seen, pictures in zip(played.pool.asked, played.pool.pictures, strict=True):
        assert [image.name for image in seen.images] != []
        assert [image.sha256 for image in seen.images] == [hashlib.sha256(data).hexdigest() for data in pictures]


# --- orders -----------------------------------------------------------------------------------------------


async def test_an_order_is_carried_out_reported_and_shown_in_the_next_step(play: Play) -> None:
    played = await play({("Stalkers", 0): ATTACK}, max_steps=2)
    first, second = played.ear.reports
    (stalkers, zealots) = first.agents
    assert stalkers.accepted == ("Stalker-1 <Attack_Unit(0xb)>",)
    assert (stalkers.latency_s, stalkers.usage, zealots.accepted) == (1.5, Usage(requests=1), ())
    assert (len(first.functions), first.env_steps, first.game_loop) == (1, 1, 11)
    assert "0xb" in first.functions[0]
    assert (second.functions, second.game_loop) == ((), 22)
    assert [seen.accepted for seen in played.pool.of("Stalkers")] == [(), ("Stalker-1 <Attack_Unit(0xb)>",)]
    assert [seen.accepted for seen in played.pool.of("Zealots")] == [(), ()]
    assert played.results[0].accepted == 1


async def test_what_is_refused_is_said_in_the_report_and_in_the_next_step(play: Play) -> None:
    words = "<MessageTo(Nobody, 'hi')>\nActions:\nTeam Stalker-1:\n<Attack_Unit(0x77)>\n<Fly()>"
    played = await play({("Stalkers", 0): words}, max_steps=2)
    rejections = played.ear.reports[0].agents[0].rejections
    assert [r.reason for r in rejections] == ["unknown_target", "unknown_action", "unknown_recipient"]
    assert played.pool.of("Stalkers")[1].rejections == rejections
    assert played.pool.of("Zealots")[1].rejections == ()
    assert played.results[0].rejections == dict.fromkeys((r.reason for r in rejections), 1)


async def test_what_the_game_refuses_is_said_as_well(play: Play) -> None:
    played = await play({("Stalkers", 0): ATTACK}, max_steps=2, after={0: {"refuse": [0x1]}})
    (rejection,) = played.ear.reports[0].agents[0].rejections
    assert rejection.reason == "refused_by_game"
    assert rejection.message == "The game refused Attack_Unit: cant target air units."
    assert played.pool.of("Stalkers")[1].rejections == (rejection,)
    assert played.pool.of("Zealots")[1].rejections == ()


async def test_an_episode_begins_as_if_there_had_been_none_before(play: Play) -> None:
    played = await play({}, max_steps=3, episodes=2, after={1: {"dead": [0xB]}})
    seen = [(seen.text, seen.view) for seen in played.pool.of("Stalkers")]
    assert seen[:3] == seen[3:]
    assert seen[0] != seen[2]


async def test_what_is_shown_of_one_episode_is_not_shown_in_the_next(play: Play) -> None:
    words = f"{ATTACK}\n<Fly()>\nCommunications:\n<MessageTo(Zealots, 'go')>"
    played = await play({("Stalkers", 0): words}, max_steps=1, episodes=2)
    assert {(seen.accepted, seen.rejections, seen.messages) for seen in played.pool.asked} == {((), (), ())}


# --- words ------------------------------------------------------------------------------------------------


async def test_what_is_written_in_one_step_is_read_in_the_next_and_no_more(play: Play) -> None:
    played = await play({("Stalkers", 0): "<MessageTo(Zealots, 'go')>\n<MessageTo(Zealots, 'now')>"})
    assert [[m.text for m in seen.messages] for seen in played.pool.of("Zealots")] == [[], ["go", "now"], []]
    assert [seen.messages for seen in played.pool.of("Stalkers")] == [(), (), ()]
    said = [heard for heard in played.ear.heard if isinstance(heard, Message)]
    assert [(m.agent, m.recipient, m.text, m.episode, m.step) for m in said] == [
        ("Stalkers", "Zealots", "go", 0, 0),
        ("Stalkers", "Zealots", "now", 0, 0),
    ]
    assert played.ear.reports[0].messages == tuple(
        Received(sender="Stalkers", recipient="Zealots", text=text) for text in ("go", "now")
    )


async def test_one_that_begins_to_listen_hears_what_is_said_in_the_same_step(play: Play) -> None:
    played = await play({("Stalkers", 0): "<MessageTo(Channel-1, 'go')>", ("Zealots", 0): "<ListenTo(Channel-1)>"})
    assert [[m.text for m in seen.messages] for seen in played.pool.of("Zealots")] == [[], ["go"], []]


async def test_listening_lasts_for_the_episode(play: Play) -> None:
    script: dict[tuple[str, int], str | Answer] = {("Zealots", 0): "<ListenTo(Channel-1)>"}
    script |= {("Stalkers", step): f"<MessageTo(Channel-1, '{step}')>" for step in range(3)}
    played = await play(script, max_steps=3, episodes=1)
    assert [[m.text for m in seen.messages] for seen in played.pool.of("Zealots")] == [[], ["0"], ["1"]]


async def test_in_a_new_episode_nobody_listens(play: Play) -> None:
    wishes = iter(("<ListenTo(Channel-1)>", ""))

    class Script(dict[tuple[str, int], Any]):
        def get(self, key: tuple[str, int], default: Any = None) -> Any:
            if key == ("Zealots", 0):
                return next(wishes)
            return "<MessageTo(Channel-1, 'go')>" if key == ("Stalkers", 0) else default

    played = await play(Script(), max_steps=2, episodes=2)
    assert [[m.text for m in seen.messages] for seen in played.pool.of("Zealots")] == [[], ["go"], [], []]


# --- agents that do not answer ----------------------------------------------------------------------------


async def test_what_became_of_an_answer_is_reported(play: Play) -> None:
    late = Answer("late", detail="no reply before the deadline", ignored=3)
    played = await play({("Stalkers", 0): late}, max_steps=1)
    stalkers, zealots = played.ear.reports[0].agents
    assert (stalkers.agent, stalkers.side, stalkers.status) == ("Stalkers", "blue", "late")
    assert (stalkers.detail, stalkers.ignored, stalkers.latency_s) == ("no reply before the deadline", 3, None)
    assert stalkers.usage == Usage()
    assert (zealots.agent, zealots.status, zealots.ignored) == ("Zealots", "ok", 0)
    assert played.results[0].statuses == {"Stalkers": {"late": 1}, "Zealots": {"ok": 1}}


async def test_without_a_default_reply_the_units_of_one_that_is_late_go_on(play: Play) -> None:
    played = await play({("Stalkers", 0): Answer("late")}, max_steps=1)
    assert played.ear.reports[0].functions == ()
    assert played.ear.reports[0].agents[0].rejections == ()


async def test_the_default_reply_of_one_that_is_late_is_carried_out_and_delivered(play: Play) -> None:
    default = f"<MessageTo(Zealots, 'I am late')>\n{ATTACK}"
    played = await play(
        {("Stalkers", 0): Answer("late"), ("Zealots", 0): "Analysis: I wait."}, max_steps=2, default_reply=default
    )
    first = played.ear.reports[0]
    assert [agent.accepted for agent in first.agents] == [("Stalker-1 <Attack_Unit(0xb)>",), ()]
    assert [m.text for m in played.pool.of("Zealots")[1].messages] == ["I am late"]


# --- the end ------------------------------------------------------------------------------------------------


async def test_an_episode_ends_when_the_game_says_so(play: Play) -> None:
    played = await play({}, max_steps=9, after={1: {"outcome": "win", "dead": [0xB]}})
    (result,) = played.results
    assert (result.outcome, result.cause, result.steps, result.game_loop) == ("win", "enemy defeated", 2, 22)
    assert (result.killed.units, result.killed.value, result.kd) == (1, 100.0, None)
    assert len(played.pool.asked) == 4


async def test_an_episode_ends_after_the_steps_that_the_task_allows(play: Play) -> None:
    played = await play({}, max_steps=4, after={2: {"dead": [0x1]}})
    (result,) = played.results
    assert (result.outcome, result.cause, result.steps) == ("cut", "step limit", 4)
    assert (result.lost.units, result.lost.value, result.kd) == (1, 0.0, None)


async def test_every_episode_is_counted_by_itself(play: Play) -> None:
    played = await play({("Stalkers", 0): ATTACK}, max_steps=2, episodes=3, after={1: {"outcome": "loss"}})
    assert [(r.steps, r.accepted, r.cause) for r in played.results] == [(2, 1, "defeated")] * 3
    assert {result.usage["Stalkers"].requests for result in played.results} == {2}


# --- how long it takes ------------------------------------------------------------------------------------


async def test_a_report_says_how_long_each_phase_took(play: Play) -> None:
    played = await play({}, max_steps=2)
    for report in played.ear.reports:
        assert (report.timings.publish_s, report.timings.wait_s, report.timings.held_s) == (0.25, 0.5, 0.125)
        assert min(report.timings.model_dump(exclude={"lag_s"}).values()) > 0


def test_a_phase_that_is_entered_twice_or_fails_is_counted_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter((0.0, 1.0, 10.0, 12.0, 20.0, 23.0))
    monkeypatch.setattr("khala_orchestrator.match.match.time.perf_counter", lambda: next(times))
    watch = Stopwatch()
    with watch.phase("observe"):
        pass
    with watch.phase("observe"):
        pass
    with pytest.raises(ZeroDivisionError), watch.phase("game"):
        raise ZeroDivisionError
    found = watch.timings(Answers({}, publish_s=4.0, wait_s=5.0), lag_s=6.0)
    assert found == Timings(observe_s=3.0, publish_s=4.0, wait_s=5.0, act_s=0.0, game_s=3.0, lag_s=6.0)


async def test_a_match_can_be_played_without_anybody_to_hear_of_it(
    config: MakeConfig, start: Start, still_game: MakeGame
) -> None:
    script: dict[tuple[str, int], str | Answer] = {("Stalkers", 0): "<MessageTo(Zealots, 'go')>"}
    match = _match(config(), await start(still_game()), Pool(script), SilentObserver())
    assert [result.steps async for result in match.play()] == [3]


# --- what stays from step to step ---------------------------------------------------------------------------------


async def test_notes_stay_until_they_are_forgotten_or_there_is_no_room(play: Play) -> None:
    script: dict[tuple[str, int], str | Answer] = {
        ("Stalkers", 0): "<Note('''hold the\nramp''')> <Note(two Zealots seen)>",
        ("Stalkers", 1): "<Note(attack at 2:00)> <Forget(1)>",
        ("Stalkers", 2): "<Forget(2)>",
    }
    played = await play(script, memory={"notes": 2}, max_steps=4)
    one, two, three, four = played.pool.of("Stalkers")
    assert "Your notes" not in one.text
    assert "\nYour notes\n    1: (0:00) hold the ramp\n    2: (0:00) two Zealots seen\n" in two.text
    assert [(note.number, note.text) for note in three.view.notes] == [(2, "two Zealots seen"), (3, "attack at 2:00")]
    assert [fault.message for fault in three.rejections] == ["You have no note 1."]
    assert [note.number for note in four.view.notes] == [3]
    assert not any(seen.view.notes for seen in played.pool.of("Zealots"))


async def test_without_a_notebook_a_note_is_refused(play: Play) -> None:
    played = await play({("Stalkers", 0): "<Note(go)>"})
    assert [fault.message for fault in played.pool.of("Stalkers")[1].rejections] == ["No notes are kept in this task."]


async def test_a_message_stays_with_its_age_until_it_is_answered_or_too_old(play: Play) -> None:
    script: dict[tuple[str, int], str | Answer] = {
        ("Stalkers", 0): "<MessageTo(Zealots, 'go')>",
        ("Stalkers", 3): "<MessageTo(Zealots, 'stop')>",
        ("Zealots", 5): "<MessageTo(Stalkers, 'done')>",
    }
    played = await play(script, memory={"messages_s": 1.2}, step_loops=11, max_steps=7)
    ages = [[(one.text, one.age_s) for one in seen.messages] for seen in played.pool.of("Zealots")]
    assert ages == [[], [("go", 0.5)], [("go", 1.0)], [], [("stop", 0.5)], [("stop", 1.0)], []]
    one, two = (played.pool.of("Zealots")[step].text for step in (1, 2))
    assert "    Message from Stalkers, new, 0:00 ago: '''go'''\n" in one
    assert "    Message from Stalkers, 0:01 ago: '''go'''\n" in two


async def test_a_refusal_that_repeats_names_what_is_possible_instead(play: Play) -> None:
    blink = "Actions:\nTeam Stalker-1:\n<Ability_Blink_Screen([12, 12])>"
    script: dict[tuple[str, int], str | Answer] = {("Stalkers", step): blink for step in (0, 1, 2, 4)}
    played = await play(script, max_steps=6)
    said = [" ".join(fault.message for fault in seen.rejections) for seen in played.pool.of("Stalkers")]
    again = " Refused 3 times in a row for the same reason; what was possible: "
    assert [again in words for words in said] == [False, False, False, True, False, False]
    assert "Attack_Unit" in said[3].partition(again)[2]
    assert said[4] == ""
    assert "in a row" not in said[5]


@pytest.mark.parametrize("count", [97, 300])
async def test_every_refused_call_counts_however_few_are_listed(count: int, play: Play) -> None:
    wrong = "Actions:\nTeam Stalker-1:\n" + "\n".join(f"<Fire_{number}()>" for number in range(count))
    played = await play({("Stalkers", 0): wrong}, max_steps=2)
    assert sum(played.results[0].rejections.values()) == count
    assert len(played.pool.of("Stalkers")[1].rejections) == 11  # ten, and one for all others


async def test_of_two_refusals_that_repeat_neither_recommends_the_other(play: Play) -> None:
    wrong = "Actions:\nTeam Stalker-1:\n<Attack_Unit(0xeee)>\n<Move_Screen([99, 99])>"
    played = await play({("Stalkers", step): wrong for step in range(3)}, max_steps=4, max_actions=2)
    attack, move = played.pool.of("Stalkers")[3].rejections
    for fault in (attack, move):
        again = fault.message.partition("Refused 3 times in a row for the same reason")[2]
        assert again
        assert not {"Attack_Unit", "Move_Screen"} & set(again.replace(",", "").replace(".", "").split())


async def test_a_standing_order_is_carried_out_until_it_is_revoked(play: Play) -> None:
    script: dict[tuple[str, int], str | Answer] = {
        ("Stalkers", 0): "Actions:\nTeam Stalker-1:\n<Standing(Attack_Unit(0xb), until 1:00)>",
        ("Stalkers", 2): "<Revoke(1)> <Revoke(4)>",
    }
    played = await play(script, standing_orders=2, max_steps=4)
    assert [report.functions for report in played.ear.reports] == [("Attack_unit(now, [0x1], 0xb)",)] * 2 + [()] * 2
    one, two, three, four = played.pool.of("Stalkers")
    assert two.accepted == ("Stalker-1 <Standing(Attack_Unit(0xb), until 1:00)>",)
    assert "1: Stalker-1 <Attack_Unit(0xb)> until 1:00: carried out 2 times\n" in three.text
    assert four.accepted == ("<Revoke(1)>",)
    assert [fault.message for fault in four.rejections] == ["You have no standing order 4; you have none."]
    assert not one.view.standing
    assert not four.view.standing


# --- what could not be read --------------------------------------------------------------------------------------

ORDER = "Actions:\n    Team Stalker-1:\n        <Stop()>\n"


def reply_of(text: str, status: ReplyStatus = "ok", *, cut: bool = False) -> Answer:
    said = Reply(run="test", agent="Stalkers", side="blue", episode=0, step=0, text=text, status=status, cut=cut)
    return Answer(status, said)


@pytest.mark.parametrize(
    ("given", "begins"),
    [
        (reply_of("", "empty"), "Your last answer was empty: write your actions"),
        (reply_of("", "cut"), "Your last answer was cut at the limit of tokens before it said anything"),
        (reply_of("I can't help with that.", "refused"), "You declined to answer"),
        (reply_of("", "filtered"), "Your last answer was taken away by a filter"),
        (
            reply_of("Let us attack the weak one with Attack_Unit(0x1) at once."),
            "Nothing could be read in your last answer.",
        ),
        (reply_of("Valid actions\n    Team Stalker-1: <Stop()>"), "Your last answer only repeats what you were shown"),
        (
            reply_of(ORDER + "        <Move_Scr", cut=True),
            "Your last answer was cut at the limit of tokens; what was cut off",
        ),
    ],
)
async def test_what_was_not_read_comes_back_in_one_sentence(play: Play, given: Answer, begins: str) -> None:
    played = await play({("Stalkers", 0): given}, max_steps=3)
    _, seen, after = played.pool.of("Stalkers")
    (said,) = [fault for fault in seen.rejections if fault.reason == "unread"]
    assert said.message.startswith(begins)
    assert f"\n    {said.message}\n" in seen.text.partition("Your last errors")[2]
    assert not after.rejections


@pytest.mark.parametrize("text", [ORDER, "Analysis: we wait.\nActions:\n", "", "Actions: none"])
async def test_an_answer_that_was_read_or_says_nothing_on_purpose_is_left_alone(play: Play, text: str) -> None:
    played = await play({("Stalkers", 0): reply_of(text)}, max_steps=2)
    assert not [fault for fault in played.pool.of("Stalkers")[1].rejections if fault.reason == "unread"]
