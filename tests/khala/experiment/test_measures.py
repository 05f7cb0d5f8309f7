"""The measures of a recording: of real matches, and of made-up ones where one rule is looked at."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import sqlite3
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

import pytest
import pytest_asyncio

from khala_agents.policy import FunctionPolicy
from khala_agents.worker import run_worker
from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.game.game import GameConfig, GameThread, Sides
from khala_bridge.game.pysc2_game import PySC2Game
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.host import host
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.codec import encode
from khala_protocol.errors import RecordingError
from khala_protocol.keys import RUN_TOPICS, Topic, agent_key, run_key
from khala_protocol.messages import (
    HALLUCINATION_KINDS,
    LOOPS_PER_S,
    ActionSpec,
    AgentCard,
    AgentReport,
    Casualties,
    Clock,
    Counts,
    Message,
    ModelCall,
    Observation,
    Place,
    Production,
    Received,
    Rejection,
    RejectionReason,
    Report,
    Resources,
    Result,
    Run,
    TeamView,
    TypeCount,
    UnitView,
    Usage,
    View,
    Wire,
)
from khala_protocol.recording import Recorder, Recording
from khala_sc2.dataset.heeding import is_acted_on
from khala_sc2.experiment.measures import GROUPS, Measures, measure
from khala_sc2.experiment.measures.hallucinations import COLUMNS
from khala_sc2.playing.spending import spent_usd
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Mapping

    from khala_protocol.messages import Briefing

GOLDEN = Path(__file__).parents[1] / "golden.mcap"
RUN = "made-up"


# --- real matches -----------------------------------------------------------------------------------------------------


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def game(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Sides]:
    sc2path = install(tmp_path_factory.mktemp("sc2"))
    config = GameConfig(sc2path=sc2path, map=load_task("2s3z_pair").map_spec, seed=1)
    async with Sides(GameThread(lambda: PySC2Game(config)), [RawExecutor()]) as sides:
        yield sides


async def played(
    game: Sides, path: Path, decide: Mapping[str, Callable[[Briefing, Observation], str]], **changes: Any
) -> Recording:
    """Return the recording of a match of two agents."""
    broker, task = MemoryBroker(), change(load_task("2s3z_pair"), **changes)
    workers = [
        asyncio.ensure_future(run_worker(broker.session(), RUN, "blue", agent, FunctionPolicy(function)))
        for agent, function in decide.items()
    ]
    await host(MatchConfig(task=task, run=RUN, record=path), game, broker.session())
    await asyncio.gather(*workers)
    return Recording.open(path)


def assert_agrees(row: Measures, result: Result) -> None:
    """Check that a row has the sums of the result."""
    usage = sum(result.usage.values(), Usage())
    statuses = [count for counts in result.statuses.values() for count in counts.items()]
    assert (row.steps, row.decisions) == (result.steps, sum(number for _, number in statuses))
    assert (row.accepted, row.rejected) == (result.accepted, sum(result.rejections.values()))
    for reason in get_args(RejectionReason):
        assert getattr(row, f"rejected_{reason}") == result.rejections.get(reason, 0)
    for fate in ("fresh", "stale", "adapted", "refused", "dropped"):
        assert getattr(row, fate) == sum(counts.get(fate, 0) for counts in result.fates.values())
    for column, status in (("fallbacks", "fallback"), ("late", "late"), ("gone", "gone"), ("malformed", "malformed")):
        assert getattr(row, column) == sum(number for name, number in statuses if name == status)
    assert row.unasked == sum(sum(counts.values()) for counts in result.unasked.values())
    assert (row.requests, row.prompt_tokens, row.cost_usd) == (usage.requests, usage.prompt_tokens, usage.cost_usd)
    assert row.rejected == sum(getattr(row, kind) for kind in COLUMNS)


def test_the_golden_battle_has_one_row_with_the_sums_of_its_result() -> None:
    golden = Recording.open(GOLDEN)
    (row,) = measure(golden)
    assert_agrees(row, golden.results[0])
    assert (row.task, row.seed, row.outcome, row.killed_units, row.lost_value) == ("2s3z_pair", 1, "win", 5, 475.0)
    assert row.latency_p95_s == golden.results[0].latency_p95_s
    assert row.messages_sent == len(list(golden.of(Message)))
    assert (row.models, row.paid_usd) == ("focus-fire", sum(spent_usd(golden).values()))
    assert row.workers_end is None


@pytest.mark.game
@pytest.mark.asyncio(loop_scope="module")
async def test_wrong_calls_of_a_match_are_counted_by_their_kind(game: Sides, tmp_path: Path) -> None:
    def wrong(_: Briefing, seen: Observation) -> str:
        team = seen.view.teams[0]
        own = next(unit.tag for unit in team.units if unit.alliance == "own")
        orders = f"<Fly_Away()><Attack_Unit(0x7777)><Attack_Unit({own})><Move_Screen([40, 9])>"
        return f"Actions:\nTeam {team.name}:\n{orders}\nCommunications:\n<MessageTo(Nobody, '''Hello''')>"

    recording = await played(game, tmp_path / "r.mcap", {"Stalkers": wrong, "Zealots": lambda *_: ""}, max_steps=2)
    (row,) = measure(recording)
    assert_agrees(row, recording.results[0])
    assert row.rejected_unknown_action + row.rejected_unknown_target + row.rejected_unknown_recipient >= 6
    assert row.input_conflicting >= 6
    kinds = {"input_conflicting": row.input_conflicting, "fact_conflicting": 2, "context_conflicting": 2}
    assert {kind: getattr(row, kind) for kind in kinds} == recording.results[0].hallucinations == kinds
    assert (row.messages_sent, row.messages_undeliverable, row.messages_read, row.outdated) == (2, 2, 0, 0)
    assert row.hallucinated_share == 1.0


@pytest.mark.game
@pytest.mark.asyncio(loop_scope="module")
async def test_decisions_that_take_effect_later_still_find_what_they_read(game: Sides, tmp_path: Path) -> None:
    def write(_: Briefing, seen: Observation) -> str:
        return f"Communications:\n<MessageTo(Zealots, '''Step {seen.step}''')>"

    def answer(_: Briefing, seen: Observation) -> str:
        return "Communications:\n<MessageTo(Stalkers, '''Yes''')>" if seen.messages and seen.step > 3 else ""

    decide = {"Stalkers": write, "Zealots": answer}
    recording = await played(game, tmp_path / "r.mcap", decide, max_steps=12, rule="budget")
    (row,) = measure(recording)
    assert_agrees(row, recording.results[0])
    assert row.age_p50_loops == 22
    assert (row.messages_read, row.messages_answered, row.messages_acted_on) == (4, 3, 0)  # asked every third step
    assert row.messages_sent == len(list(recording.of(Message)))


# --- made-up recordings -----------------------------------------------------------------------------------------------


def recorded(path: Path, *messages: Wire) -> Recording:
    """Return a recording of these messages."""
    with Recorder(path) as recorder:
        for message in messages:
            fields, topic = message.model_dump(), Topic(message.model_dump()["kind"])
            on_run = topic in RUN_TOPICS
            key = run_key(RUN, topic) if on_run else agent_key(RUN, fields["side"], fields["agent"], topic)
            recorder.write(key, encode(message))
    return Recording.open(path)


CARD = Run(
    run=RUN,
    task="task",
    map_name="Map",
    map_sha256="",
    seed=7,
    episodes=2,
    game="game",
    opponent="nobody",
    executor="raw",
    clock=Clock(),
    agents=(AgentCard(name="A", side="blue", teams=()), AgentCard(name="B", side="blue", teams=())),
    catalogue_sha256="",
    versions={},
)


def seen(agent: str = "A", step: int = 0, *, time_s: float = 0.0, **fields: Any) -> Observation:
    view = View(time_s=time_s, **{name: fields.pop(name) for name in View.model_fields.keys() & fields.keys()})
    where = {"run": RUN, "agent": agent, "side": "blue", "episode": 0, "step": step, "answer_within_s": None}
    loop = round(time_s * LOOPS_PER_S)
    return Observation(**({**where, "game_loop": loop, "text": "", "view": view} | fields))


def report(step: int = 0, *agents: AgentReport, side: str = "blue", episode: int = 0, **fields: Any) -> Report:
    return Report(run=RUN, side=side, episode=episode, step=step, game_loop=step * 224, agents=agents, **fields)


def decided(agent: str = "A", **fields: Any) -> AgentReport:
    return AgentReport(**({"agent": agent, "side": "blue", "status": "ok", "fate": "fresh"} | fields))


def rejected(reason: RejectionReason, text: str = "<X()>", team: str | None = None) -> Rejection:
    return Rejection(reason=reason, message="No.", text=text, start=0, team=team)


def result(side: str = "blue", episode: int = 0, **fields: Any) -> Result:
    known = {"outcome": "win", "cause": "", "steps": 1, "game_loop": 224, "game_s": 10.0, "wall_s": 1.0, "kd": None}
    known |= {"killed": Casualties(), "lost": Casualties()}
    return Result(**({"run": RUN, "side": side, "episode": episode} | known | fields))


def test_every_reason_for_a_rejection_has_a_kind() -> None:
    assert set(HALLUCINATION_KINDS) == set(get_args(RejectionReason))


def test_kinds_of_hallucinations_are_those_of_the_paper() -> None:
    by_kind = {kind: [reason for reason, judged in HALLUCINATION_KINDS.items() if judged.kind == kind] for kind in (
        "fact_conflicting", "context_conflicting", None,
    )}  # fmt: skip
    assert by_kind == {
        "fact_conflicting": ["friendly_target"],  # an ally taken for an enemy
        "context_conflicting": ["wrong_frame"],  # a screen point as one of the minimap, or the reverse
        None: ["unread", "too_late", "too_many_actions", "too_many_messages", "refused_by_game"],
    }


def test_a_row_is_flat_its_columns_are_in_the_order_of_the_groups_and_a_database_takes_it(tmp_path: Path) -> None:
    (row,) = measure(recorded(tmp_path / "r.mcap", CARD, report(), result()))
    fields = [field.name for field in dataclasses.fields(Measures)]
    assert fields == [field.name for group in GROUPS for field in dataclasses.fields(group)]
    plain = {str, int, float, bool, str | None, int | None, float | None}
    assert set(get_type_hints(Measures).values()) <= plain
    with contextlib.closing(sqlite3.connect(":memory:")) as database:
        database.execute(f"CREATE TABLE measures ({', '.join(fields)})")
        database.execute(f"INSERT INTO measures VALUES ({', '.join('?' * len(fields))})", dataclasses.astuple(row))
        assert database.execute("SELECT * FROM measures").fetchone() == dataclasses.astuple(row)


def test_each_side_and_episode_has_a_row_and_the_seed_grows_with_the_episode(tmp_path: Path) -> None:
    steps = [report(side=side, episode=episode) for episode in (0, 1) for side in ("red", "blue")]
    results = [result(one.side, one.episode) for one in steps]
    rows = measure(recorded(tmp_path / "r.mcap", CARD, *steps, *results))
    assert [(row.episode, row.side, row.seed) for row in rows] == [
        (0, "blue", 7),
        (0, "red", 7),
        (1, "blue", 8),
        (1, "red", 8),
    ]


def test_an_episode_without_a_result_is_unfinished_and_says_what_it_cost(tmp_path: Path) -> None:
    usage = Usage(requests=1, prompt_tokens=100, cost_usd=0.5)
    call = ModelCall(
        run=RUN, agent="A", side="blue", episode=0, step=1, attempt=1, model="m", endpoint="http://e", prompt=(),
        completion=None, status="ok", started_s=0, latency_s=0, usage=usage, params={"temperature": 0, "n": 1},
    )  # fmt: skip
    late = call.model_copy(update={"step": 2})
    (row,) = measure(recorded(tmp_path / "r.mcap", CARD, call, report(1, decided(usage=usage)), late))
    assert (row.outcome, row.valid, row.game_s, row.wall_s, row.kd) == ("unfinished", False, 10.0, None, None)
    assert row.opponent == "nobody"
    assert (row.requests, row.prompt_tokens, row.cost_usd, row.paid_usd) == (1, 100, 0.5, 1.0)
    assert (row.models, row.endpoints, row.params) == ("m", "http://e", "n=1, temperature=0")


def test_money_is_unknown_without_a_price(tmp_path: Path) -> None:
    (row,) = measure(recorded(tmp_path / "r.mcap", CARD, report(0, decided(usage=Usage(requests=1))), result()))
    assert (row.requests, row.cost_usd, row.paid_usd) == (1, None, None)


def test_faults_and_people_are_counted_by_what_happened(tmp_path: Path) -> None:
    advice = Received(sender="Coach", recipient="A", text="Go.")
    agents = [
        decided(status="fallback", detail="timeout", ignored=2),
        decided(status="fallback", detail="http 500"),
        decided(status="fallback", detail="timeout"),
        decided(status="late", fate=None),
        decided(status="empty", fate=None),
        decided(status="gone", fate=None),
        decided(status="malformed", fate=None),
    ]
    step = report(0, *agents, messages=(advice,), advisers=("Coach",), incidents=("A was away",))
    (row,) = measure(recorded(tmp_path / "r.mcap", CARD, step, result()))
    assert (row.undecided, row.fallbacks) == (7, 3)
    assert row.undecided_because == "empty: 1; gone: 1; http 500: 1; late: 1; malformed: 1; timeout: 2"
    assert (row.late, row.gone, row.malformed, row.ignored) == (1, 1, 1, 2)
    assert (row.advice, row.incidents, row.messages_sent) == (1, 1, 0)


def test_a_default_reply_does_not_hallucinate(tmp_path: Path) -> None:
    stood_in = decided(status="fallback", accepted=("T <X()>",), rejections=(rejected("unknown_action"),))
    (row,) = measure(recorded(tmp_path / "r.mcap", CARD, report(0, stood_in), result()))
    assert (row.rejected, row.not_hallucinated, row.calls, row.hallucinated_share) == (1, 1, 0, None)


UNIT = UnitView(tag="0x1", type="Zealot", alliance="enemy", screen=(1, 1), minimap=(1, 1), health=1, health_max=1)
TEAM = TeamView(name="T-1", units=(UNIT,), actions=(ActionSpec(name="Blink"),))
KNEW = seen(text="Zealot | tag 0x1", teams=(TEAM, TeamView(name="Empty")))


@pytest.mark.parametrize(
    ("rejection", "is_outdated"),
    [
        (rejected("dead_target", "<Attack_Unit(0x1)>"), True),
        (rejected("unknown_target", "<Attack_Unit(0X1)>"), True),
        (rejected("unknown_target", "<Attack_Unit(0x2)>"), False),
        (rejected("not_available", "<Blink(0x1)>", "t-1"), True),
        (rejected("not_available", "<Blink(0x2)>", "T-1"), False),
        (rejected("not_available", "<Charge()>", "T-1"), False),
        (rejected("not_available", "<Blink()>", "Empty"), False),
        (rejected("unknown_team", team="T-1"), True),
        (rejected("unknown_team", team="Empty"), False),
        (rejected("unknown_team"), False),
        (rejected("invalid_target", "<Blink(0x1)>", "T-1"), False),
    ],
)
def test_a_call_that_time_made_wrong_is_outdated_and_no_hallucination(
    tmp_path: Path, rejection: Rejection, is_outdated: bool
) -> None:
    at_once, later = decided(rejections=(rejection,)), decided(rejections=(rejection,), age_loops=22, asked_step=0)
    (row,) = measure(recorded(tmp_path / "later.mcap", CARD, KNEW, report(2, later), result()))
    assert (row.outdated, row.not_hallucinated) == (is_outdated, is_outdated)
    assert row.hallucinated_share == (0.0 if is_outdated else 1.0)
    (row,) = measure(recorded(tmp_path / "at_once.mcap", CARD, KNEW, report(0, at_once), result()))
    assert (row.outdated, row.hallucinated_share) == (0, 1.0)


# --- communication ----------------------------------------------------------------------------------------------------

PLACES = (Place(name="Base 2", what="base", minimap=(40, 20)), Place(name="Base 21", what="base", minimap=(9, 9)))


@pytest.mark.parametrize(
    ("text", "order", "is_so"),
    [
        ("We fire on 0x1.", "T-1 <Attack_Unit(0x1)>", True),
        ("We fire on 0x1.", "T-1 <Attack_Unit(0x2)>", False),
        ("Kill the zealots!", "T-1 <Attack_Unit(0x1)>", True),
        ("Kill the Stalkers!", "T-1 <Attack_Unit(0x1)>", False),
        ("Gather at [41.4, 25.0].", "T-1 <Move_Minimap([40, 23])>", True),
        ("Gather at [41.4, 25.0].", "T-1 <Move_Minimap([20, 23])>", False),
        ("Gather at [12, 12].", "T-1 <Move_Screen([12, 12])>", False),
        ("Attack base 2.", "T-1 <Attack_Minimap([41, 21])>", True),
        ("Attack Base 21.", "T-1 <Attack_Minimap([41, 21])>", False),
        ("Two photon cannons, please.", "B <Build_PhotonCannon_Screen([3, 4])>", True),
        ("We need Stalkers.", "B <Standing(Train_Stalker(), until 4 Stalker)>", True),
        ("Hold the unit.", "T-1 <Attack_Unit(0x3)>", False),
    ],
)
def test_an_order_acts_on_a_message_if_both_name_the_same_thing(text: str, order: str, is_so: bool) -> None:
    assert is_acted_on(text, {order}, seen(teams=(TEAM,), places=PLACES)) is is_so


def test_a_message_is_heeded_once_by_an_order_that_is_new_or_by_an_answer(tmp_path: Path) -> None:
    def got(step: int, *messages: Received) -> Observation:
        return seen(step=step, messages=messages)

    here, there = (Received(sender="B", recipient="A", text=f"Attack {tag}!") for tag in ("0x1", "0x2"))
    news = Received(sender="B", recipient="Front", text="All is quiet.")
    first, second = "T-1 <Attack_Unit(0x1)>", "T-1 <Attack_Unit(0x2)>"
    reply = Received(sender="A", recipient="front", text="Good.")
    recording = recorded(
        tmp_path / "r.mcap", CARD,
        got(0), report(0, decided(accepted=(first,)), decided("B"), messages=(here, there)),
        got(1, here), report(1, decided(accepted=(first,)), messages=(news,)),  # it attacked that one before
        got(2, there), report(2, decided(accepted=(second,))),  # acted on
        got(3, there.but(again=True), news), report(3, decided(), messages=(reply,)),  # answered
        got(4, there), report(4, decided(status="late", fate=None)),  # not read
        got(5, Received(sender="Coach (a person)", recipient="A", text="Attack 0x2!")), report(5, decided()),
        result(),
    )  # fmt: skip
    (row,) = measure(recording)
    assert (row.messages_sent, row.messages_read) == (4, 3)
    assert (row.messages_answered, row.messages_acted_on, row.messages_heeded) == (1, 1, 2)
    assert row.heeded_share == pytest.approx(2 / 3)


def test_a_message_is_unfounded_if_its_sender_did_not_see_what_it_names(tmp_path: Path) -> None:
    founded, unfounded, plain = (
        Received(sender="A", recipient="B", text=text) for text in ("Kill 0X1!", "Kill 0x1 and 0x2!", "Kill them!")
    )
    steps = [KNEW, report(0, decided(), messages=(founded, unfounded, plain)), result()]
    (row,) = measure(recorded(tmp_path / "tags.mcap", CARD, *steps))
    assert (row.messages_sent, row.messages_unfounded) == (3, 1)
    (row,) = measure(recorded(tmp_path / "plain.mcap", CARD, KNEW, report(0, decided(), messages=(plain,)), result()))
    assert (row.messages_sent, row.messages_unfounded) == (1, None)


# --- economy ----------------------------------------------------------------------------------------------------------


def at(
    time_s: float, *, agent: str = "A", probes: int = 12, used: float = 12, cap: float = 15, **more: Any
) -> Observation:
    halls = TypeCount(type="Nexus", ready=more.get("halls", 1), under_way=more.get("begun", ()))
    training = Production(order="Train_Probe", progress=(0.5,) * more.get("training", 0))
    counts = Counts(units=(TypeCount(type="Probe", ready=probes),), structures=(halls,), production=(training,))
    has = Resources(minerals=more.get("minerals", 50), vespene=0, supply_used=used, supply_cap=cap)
    return seen(agent, round(time_s), time_s=time_s, resources=has, counts=counts)


def test_the_economy_is_what_observations_say_until_the_next_one(tmp_path: Path) -> None:
    recording = recorded(
        tmp_path / "r.mcap", CARD,
        at(0), at(0, agent="B", minerals=9999),  # the same moment
        at(100, probes=15, used=15, minerals=200),  # blocked, until 110
        at(110, probes=16, used=16, cap=23, begun=(0.01,), minerals=0),
        at(300, probes=30, used=44, cap=60, halls=2, training=2),
        at(310, probes=30, used=200, cap=200, halls=2, minerals=100),  # the most there is
        report(), result(game_s=320.0),
    )  # fmt: skip
    (row,) = measure(recording)
    assert (row.supply_blocked_s, row.expansion_s) == (10.0, 110.0)
    assert row.minerals_mean == pytest.approx((50 * 100 + 200 * 10 + 0 * 190 + 50 * 10 + 100 * 10) / 320)
    assert (row.workers_5min, row.army_supply_5min) == (30, 12.0)
    assert (row.workers_end, row.army_supply_end, row.bases_end) == (30, 170.0, 2)


def test_a_battle_has_no_economy_and_a_short_game_no_fifth_minute(tmp_path: Path) -> None:
    battle = [seen(counts=Counts()), report(), result()]
    (row,) = measure(recorded(tmp_path / "battle.mcap", CARD, *battle))
    assert (row.minerals_mean, row.workers_end, row.bases_end) == (None, None, None)
    (row,) = measure(recorded(tmp_path / "short.mcap", CARD, at(0), report(), result()))
    assert (row.minerals_mean, row.workers_5min, row.expansion_s, row.bases_end) == (50.0, None, None, 1)


# --- files ------------------------------------------------------------------------------------------------------------


def test_bytes_that_are_no_message_are_passed_over(tmp_path: Path) -> None:
    with Recorder(tmp_path / "r.mcap") as recorder:
        recorder.write(run_key(RUN, Topic.RUN), encode(CARD))
        recorder.write(agent_key(RUN, "blue", "A", Topic.OBSERVATION), b"{")
        recorder.write(run_key(RUN, Topic.REPORT), encode(report(0, decided(accepted=("T <X()>",)))))
    (row,) = measure(Recording.open(tmp_path / "r.mcap"))
    assert (row.accepted, row.messages_read) == (1, 0)


def test_an_observation_with_a_field_of_a_later_version_still_has_its_economy(tmp_path: Path) -> None:
    newer = encode(at(0)).replace(b'"text":', b'"mood":"good","text":')
    aged = decided(rejections=(rejected("dead_target", "<X(0x1)>"),), age_loops=8, asked_step=0)
    with Recorder(tmp_path / "r.mcap") as recorder:
        recorder.write(run_key(RUN, Topic.RUN), encode(CARD))
        recorder.write(agent_key(RUN, "blue", "A", Topic.OBSERVATION), newer)
        recorder.write(run_key(RUN, Topic.REPORT), encode(report(1, aged)))
    (row,) = measure(Recording.open(tmp_path / "r.mcap"))
    assert (row.bases_end, row.input_conflicting, row.outdated) == (1, 1, 0)  # what it showed is not known


def test_a_recording_without_a_run_card_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="has no run card, so nobody can say what was played"):
        measure(recorded(tmp_path / "r.mcap", report()))
