"""Keys: built and parsed in one place, and no name can make one mean more than it says."""

from __future__ import annotations

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from khala_protocol.errors import WrongKey
from khala_protocol.keys import (
    AGENT_TOPICS,
    NUMBERED_TOPICS,
    RUN_TOPICS,
    Address,
    Topic,
    agent_key,
    alive_key,
    check_name,
    every_agent,
    everything,
    host_key,
    image_key,
    images_of,
    parse,
    run_key,
)

NAMES = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", fullmatch=True)
SAID = sorted(AGENT_TOPICS - NUMBERED_TOPICS)

BAD_NAMES = [
    *("", "*", "**", "a*", "$*", "a$*b", "a/b", "/", "a/", "?", "#", "@", "a b", " a", "a\n", "\n", "é", "a\x00"),
    *("-a", ".a", "_a", "..", "a" * 65, "khala/r", "ａ", "٣"),  # the last two are of other alphabets
]


@given(NAMES, NAMES, NAMES, NAMES, st.integers(0, 9999))
def test_what_is_built_is_parsed_back(run: str, side: str, agent: str, instance: str, place: int) -> None:
    for topic in RUN_TOPICS:
        assert parse(run_key(run, topic)) == Address(run, topic)
    for topic in SAID:
        assert parse(agent_key(run, side, agent, topic)) == Address(run, topic, side, agent)
    assert parse(alive_key(run, side, agent, instance)) == Address(run, Topic.ALIVE, side, agent, instance)
    assert parse(image_key(run, side, agent, place)) == Address(run, Topic.IMAGE, side, agent, str(place))


@given(st.text() | st.lists(NAMES | st.sampled_from(["khala", *Topic]), max_size=7).map("/".join))
def test_what_is_parsed_is_built_back_and_all_else_is_refused(key: str) -> None:
    try:
        address = parse(key)
    except WrongKey:
        return
    if address.instance is not None:
        assert address.side is not None
        assert address.agent is not None
        if address.topic is Topic.IMAGE:
            built = image_key(address.run, address.side, address.agent, int(address.instance))
        else:
            built = alive_key(address.run, address.side, address.agent, address.instance)
    elif address.agent is not None:
        assert address.side is not None
        built = agent_key(address.run, address.side, address.agent, address.topic)
    else:
        built = run_key(address.run, address.topic)
    assert built == key


@pytest.mark.parametrize(
    ("built", "key"),
    [
        (run_key("r1", Topic.RUN), "khala/r1/run"),
        (run_key("r1", Topic.REPORT), "khala/r1/report"),
        (run_key("r1", Topic.RESULT), "khala/r1/result"),
        (agent_key("r1", "p1", "CombatGroup1", Topic.REPLY), "khala/r1/p1/CombatGroup1/reply"),
        (host_key("r1"), "khala/r1/host"),
        (alive_key("r1", "p1", "A", "7f.2"), "khala/r1/p1/A/alive/7f.2"),
        (every_agent("r1", Topic.REPLY), "khala/r1/*/*/reply"),
        (every_agent("r1", Topic.ALIVE), "khala/r1/*/*/alive/*"),
        (image_key("r1", "p1", "A", 2), "khala/r1/p1/A/image/2"),
        (images_of("r1", "p1", "A"), "khala/r1/p1/A/image/*"),
        (every_agent("r1", Topic.IMAGE), "khala/r1/*/*/image/*"),
        (everything("r1"), "khala/r1/**"),
    ],
)
def test_keys_are_written_as_the_documentation_says(built: str, key: str) -> None:
    assert built == key


@pytest.mark.parametrize("name", BAD_NAMES, ids=ascii)
def test_no_name_can_widen_an_expression(name: str) -> None:
    for build in (
        lambda: check_name(name),
        lambda: run_key(name, Topic.RUN),
        lambda: host_key(name),
        lambda: agent_key(name, "p1", "A", Topic.REPLY),
        lambda: agent_key("r", name, "A", Topic.REPLY),
        lambda: agent_key("r", "p1", name, Topic.REPLY),
        lambda: alive_key("r", "p1", "A", name),
        lambda: images_of("r", "p1", name),
        lambda: every_agent(name, Topic.REPLY),
        lambda: everything(name),
        lambda: parse(f"khala/{name}/run"),
        lambda: parse(f"khala/r/p1/{name}/reply"),
        lambda: parse(f"khala/r/p1/A/alive/{name}"),
    ):
        with pytest.raises(WrongKey):
            build()


@given(NAMES, NAMES, NAMES, NAMES)
def test_expressions_match_what_they_say_and_nothing_else(run: str, other: str, side: str, agent: str) -> None:
    """Check expressions by the bus's own rules."""
    replies = zenoh.KeyExpr(every_agent(run, Topic.REPLY))
    whole = zenoh.KeyExpr(everything(run))
    mine = agent_key(run, side, agent, Topic.REPLY)
    assert replies.includes(zenoh.KeyExpr(mine))
    assert whole.includes(zenoh.KeyExpr(mine))
    assert not replies.includes(zenoh.KeyExpr(agent_key(run, side, agent, Topic.MESSAGE)))
    assert not replies.includes(zenoh.KeyExpr(run_key(run, Topic.REPORT)))
    if other != run:
        assert not whole.intersects(zenoh.KeyExpr(agent_key(other, side, agent, Topic.REPLY)))


@pytest.mark.parametrize(
    "key",
    [
        "",
        "khala",
        "khala/r1",
        "khala/r1/reply",
        "khala/r1/alive",
        "khala/r1/p1/A",
        "khala/r1/p1/A/run",
        "khala/r1/p1/A/alive",
        "khala/r1/p1/A/alive/i/j",
        "khala/r1/p1/A/image",
        "khala/r1/p1/A/image/x",
        "khala/r1/p1/A/image/07",
        "khala/r1/p1/A/reply/x",
        "khala/r1/p1/A/shout",
        "other/r1/run",
        "/khala/r1/run",
        "khala//run",
        "khala/*/run",
        "khala/r1/**",
    ],
)
def test_what_is_no_key_is_refused_by_name(key: str) -> None:
    with pytest.raises(WrongKey) as raised:
        parse(key)
    assert str(raised.value) == f"{key!r} is no key of this protocol"


def test_topics_are_not_put_where_they_do_not_belong() -> None:
    for topic in AGENT_TOPICS:
        with pytest.raises(WrongKey, match=f"^{topic} belongs to an agent, not to the run$"):
            run_key("r", topic)
    for topic in RUN_TOPICS:
        with pytest.raises(WrongKey, match=f"^{topic} belongs to the run, not to an agent$"):
            every_agent("r", topic)
    for topic in {*RUN_TOPICS, *NUMBERED_TOPICS}:
        with pytest.raises(WrongKey, match=f"^{topic} is no topic of an agent$"):
            agent_key("r", "p1", "A", topic)


def test_a_bad_name_is_said_with_what_it_is_for_and_what_would_do() -> None:
    with pytest.raises(WrongKey) as raised:
        agent_key("r1", "p1", "Combat Group", Topic.REPLY)
    assert str(raised.value) == (
        "agent 'Combat Group' cannot stand in a key: use 1 to 64 letters, digits, '_', '.' or '-', "
        "beginning with a letter or a digit"
    )
