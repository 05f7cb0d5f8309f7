"""Key expressions of the bus, built and parsed in this one place.

    khala/<run>/<topic>                          topic: run, report, result, terrain, scene
    khala/<run>/host                             liveliness token of the host
    khala/<run>/<side>/<agent>/<topic>           topic: briefing, observation, reply, message, exchange
    khala/<run>/<side>/<adviser>/advice          what somebody outside the match writes to agents
    khala/<run>/<side>/<agent>/image/<place>     the bytes of a picture of the newest observation, by its place in it
    khala/<run>/<side>/<agent>/alive/<instance>  liveliness token; two instances of one agent stay visible as two
    khala/service/matches                        the matches of `khala serve`
    khala/service/order/<id>                     what a client asks of it: to play a match, or to stop one

An agent writes below its own name: reply, exchange, alive; an adviser: advice. No agent has an adviser's name. Over TLS
the router enforces this, by the rules of `khala_protocol.access`; without TLS nothing does. Names of runs, sides,
agents, advisers and instances must pass `check_name`, so that no name can widen a key expression. No run may be
called `service`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum

from khala_protocol.errors import WrongKey

ROOT = "khala"
SERVICE = "service"
"""In the place of a run: what belongs to `khala serve`, see `khala_protocol.service`."""
MATCHES_KEY = f"{ROOT}/{SERVICE}/matches"
EVERY_ORDER = f"{ROOT}/{SERVICE}/order/*"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
_PLACE = re.compile(r"0|[1-9][0-9]{0,3}")
_LONGEST_SHOWN = 200


class Topic(StrEnum):
    """The last part of a key: the kind of message under it."""

    RUN = "run"
    REPORT = "report"
    RESULT = "result"
    TERRAIN = "terrain"
    SCENE = "scene"
    BRIEFING = "briefing"
    OBSERVATION = "observation"
    IMAGE = "image"
    REPLY = "reply"
    MESSAGE = "message"
    ADVICE = "advice"
    EXCHANGE = "exchange"
    ALIVE = "alive"


RUN_TOPICS = frozenset({Topic.RUN, Topic.REPORT, Topic.RESULT, Topic.TERRAIN, Topic.SCENE})
AGENT_TOPICS = frozenset(Topic) - RUN_TOPICS
NUMBERED_TOPICS = frozenset({Topic.ALIVE, Topic.IMAGE})
"""Topics of an agent that have one more part in their keys."""


@dataclass(frozen=True, slots=True)
class Address:
    """A parsed key.

    `side` and `agent` are None on topics of the run; `instance` is the last part of a key of `alive` or `image`, and
    None on others.
    """

    run: str
    topic: Topic
    side: str | None = None
    agent: str | None = None
    instance: str | None = None


def check_name(name: str, what: str = "name") -> str:
    """Return `name` if it may be part of a key.

    Raises:
        WrongKey: it is empty, longer than 64 characters, or has other characters than letters, digits, `_`, `.`, `-`.
    """
    if what == "run" and name == SERVICE:
        raise WrongKey(f"no run can be called {SERVICE!r}: under this name `khala serve` is asked for matches")
    if not _NAME.fullmatch(name):
        raise WrongKey(
            f"{what} {name[:_LONGEST_SHOWN]!r} cannot stand in a key: use 1 to 64 letters, digits, '_', '.' or '-', "
            "beginning with a letter or a digit"
        )
    return name


def run_key(run: str, topic: Topic) -> str:
    """Return the key of a topic of the whole run."""
    if topic not in RUN_TOPICS:
        raise WrongKey(f"{topic} belongs to an agent, not to the run")
    return f"{ROOT}/{check_name(run, 'run')}/{topic}"


def host_key(run: str) -> str:
    """Return the key of the liveliness token of the host; one that goes on for another has the same."""
    return f"{ROOT}/{check_name(run, 'run')}/host"


def agent_key(run: str, side: str, agent: str, topic: Topic) -> str:
    """Return the key of one agent's topic."""
    if topic not in AGENT_TOPICS - NUMBERED_TOPICS:
        raise WrongKey(f"{topic} is no topic of an agent")
    return f"{_agent_root(run, side, agent)}/{topic}"


def alive_key(run: str, side: str, agent: str, instance: str) -> str:
    """Return the key of the liveliness token of one instance of an agent."""
    return f"{_agent_root(run, side, agent)}/{Topic.ALIVE}/{check_name(instance, 'instance')}"


def image_key(run: str, side: str, agent: str, place: int) -> str:
    """Return the key of the picture at this place, from 0, in each of an agent's observations."""
    return f"{_agent_root(run, side, agent)}/{Topic.IMAGE}/{place}"


def images_of(run: str, side: str, agent: str) -> str:
    """Return the expression that matches all pictures of an agent."""
    return f"{_agent_root(run, side, agent)}/{Topic.IMAGE}/*"


def every_run(topic: Topic) -> str:
    """Return the expression that matches this topic of every run."""
    if topic not in RUN_TOPICS:
        raise WrongKey(f"{topic} belongs to an agent, not to the run")
    return f"{ROOT}/*/{topic}"


def order_key(number: str) -> str:
    """Return the key under which a client of the service sends one order."""
    return f"{ROOT}/{SERVICE}/order/{check_name(number, 'order')}"


def every_agent(run: str | None, topic: Topic) -> str:
    """Return the expression that matches this topic of every agent of a run, on every side; None: of all runs."""
    if topic not in AGENT_TOPICS:
        raise WrongKey(f"{topic} belongs to the run, not to an agent")
    tail = f"{topic}/*" if topic in NUMBERED_TOPICS else str(topic)
    return f"{ROOT}/{'*' if run is None else check_name(run, 'run')}/*/*/{tail}"


def everything(run: str) -> str:
    """Return the expression that matches every topic of a run; liveliness tokens are a separate space."""
    return f"{ROOT}/{check_name(run, 'run')}/**"


def parse(key: str) -> Address:
    """Parse a key.

    Raises:
        WrongKey: it has none of the forms in the module's docstring.
    """
    parts = key.split("/")
    if all(_NAME.fullmatch(part) for part in parts) and SERVICE not in parts[1:2]:
        match parts:
            case [root, run, topic] if root == ROOT and topic in RUN_TOPICS:
                return Address(run, Topic(topic))
            case [root, run, side, agent, Topic.ALIVE, instance] if root == ROOT:
                return Address(run, Topic.ALIVE, side, agent, instance)
            case [root, run, side, agent, Topic.IMAGE, place] if root == ROOT and _PLACE.fullmatch(place):
                return Address(run, Topic.IMAGE, side, agent, place)
            case [root, run, side, agent, topic] if root == ROOT and topic in AGENT_TOPICS - NUMBERED_TOPICS:
                return Address(run, Topic(topic), side, agent)
    raise WrongKey(f"{key[:_LONGEST_SHOWN]!r} is no key of this protocol")


def _agent_root(run: str, side: str, agent: str) -> str:
    return f"{ROOT}/{check_name(run, 'run')}/{check_name(side, 'side')}/{check_name(agent, 'agent')}"
