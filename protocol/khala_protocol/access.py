"""The access rules of a router: what the holder of a certificate may read and write, made from the names of a task.

Everything that no rule allows is denied. The rules stand in the router and hold for its links; its own session is not
subject to them, which is right for a host that is its own router.

    who         reads                                                              writes
    host        everything of the run                                              everything of the run
    agent       result; briefing, observation, images of its own                   its reply, exchange, alive
    adviser     run, report, result, whether the host is there                     its advice
    observer    everything of the run                                              nothing
    service     everything of every run, on the unix socket of `khala serve`       the same

The service `khala serve` knows no run before it is asked for one: its router has rules for any. There the host's
certificate may order matches, and the observer's may list and watch them; its workers come over a unix socket, in a
directory of their own.

Report and run card are not for agents: one has the accepted calls of all of them, the other the task of both sides.
Terrain and scenes are for neither agents nor advisers: they have the map of both sides, without fog.
Messages reach an agent in its observations.
A rule covers a key only if it includes it, and `**` does not include a part that begins with `@`, such as those under
which Zenoh keeps what late joiners ask for; so each key stands here with and without them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from khala_protocol.common_names import HOST, OBSERVER, adviser_name, agent_name
from khala_protocol.keys import EVERY_ORDER, ROOT, Topic, check_name
from khala_protocol.service import MAX_ORDER_BYTES

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

REPLY_BYTES = 512 * 1024
"""Eight times the longest text of a reply that an agent sends."""
EXCHANGE_BYTES = 4 * 1024 * 1024
"""A prompt of a million tokens, without pictures."""
QUESTION_BYTES = ADVICE_BYTES = 4096
RATE_HZ = 500.0
"""How often an agent may write under one key. Replies to two steps are at least a turn of some milliseconds apart; what
comes 2 ms after another is no answer to an observation. A flood of 20 kB frames had 2 300 of them in a second."""
MESSAGE_BYTES = 64 * 1024 * 1024
"""A router puts fragments together up to this size; Zenoh's default is a gigabyte, for each link."""

_WRITES = (Topic.REPLY, Topic.EXCHANGE)
_LISTEN = ["declare_subscriber", "declare_liveliness_subscriber", "liveliness_query", "query"]
_HEAR = ["put", "delete", "reply", "liveliness_token"]
_EVERYTHING = [*_LISTEN, *_HEAR, "declare_queryable"]


def router_settings(
    agents: Iterable[tuple[str, str]], run: str | None = None, *, advisers: Iterable[tuple[str, str]] = ()
) -> dict[str, Any]:
    """Return the settings of Zenoh for a router that these may join, for `BusConfig.zenoh`.

    Args:
        agents: side and name of each.
        run: name of the run; None allows any, for a router that does not know it.
        advisers: side and name of each.
    """
    root = f"{ROOT}/{check_name(run, 'run') if run else '*'}"
    names, advising = sorted(set(agents)), sorted(set(advisers))
    rules = [*_host(root), *_observer(root)]
    rates = list(_rates(names, advising))
    subjects = [HOST, OBSERVER]
    policies = {HOST: ["host"], OBSERVER: ["listen:observer", "hear:observer"]}
    agents_rules = {agent_name(*who): _agent(root, agent_name(*who), f"{root}/{'/'.join(who)}") for who in names}
    advisers_rules = {adviser_name(*who): _adviser(root, *who) for who in advising}
    for name, own in (agents_rules | advisers_rules).items():
        rules += own
        subjects.append(name)
        policies[name] = [rule["id"] for rule in own]
    return {
        "access_control": {
            "enabled": True,
            "default_permission": "deny",
            "rules": rules,
            "subjects": [{"id": name, "cert_common_names": [name]} for name in subjects],
            "policies": [{"subjects": [name], "rules": ids} for name, ids in policies.items()],
        },
        "low_pass_filter": list(_sizes()),
        **({"downsampling": [{"flows": ["ingress"], "messages": ["put"], "rules": rates}]} if rates else {}),
        "transport/link/rx/max_message_size": MESSAGE_BYTES,
    }


def service_settings() -> dict[str, Any]:
    """Return the settings of Zenoh for the router of `khala serve`, for `BusConfig.zenoh`."""
    settings = router_settings(())
    settings["access_control"]["subjects"].append({"id": "worker", "link_protocols": ["unixsock-stream"]})
    settings["access_control"]["policies"].append({"subjects": ["worker"], "rules": ["host"]})
    return settings


def _host(root: str) -> list[dict[str, Any]]:
    return [_rule("host", ["ingress", "egress"], _EVERYTHING, _with_caches(f"{root}/**"))]


def _observer(root: str) -> list[dict[str, Any]]:
    keys = _with_caches(f"{root}/**")
    return [
        _rule("listen:observer", ["ingress"], _LISTEN, keys),
        _rule("hear:observer", ["egress"], _HEAR, keys),
    ]


def _agent(root: str, name: str, own: str) -> list[dict[str, Any]]:
    reads = [f"{root}/result", f"{own}/briefing", f"{own}/observation", f"{own}/image/*"]
    keys = _with_caches(*reads)
    return [
        _rule(f"listen:{name}", ["ingress"], _LISTEN, keys),
        _rule(f"hear:{name}", ["egress"], _HEAR, keys),
        # The question that follows a reply shows when the router has it.
        _rule(f"speak:{name}", ["ingress"], ["put", "query"], [f"{own}/{topic}" for topic in _WRITES]),
        _rule(f"live:{name}", ["ingress"], ["liveliness_token"], [f"{own}/{Topic.ALIVE}/*"]),
        # That somebody listens to what agents write: without it, nothing is sent.
        _rule(f"audience:{name}", ["egress"], ["declare_subscriber"], [f"{root}/*/*/{topic}" for topic in _WRITES]),
    ]


def _adviser(root: str, side: str, adviser: str) -> list[dict[str, Any]]:
    name = adviser_name(side, adviser)
    own = f"{root}/{side}/{adviser}/{Topic.ADVICE}"
    keys = _with_caches(f"{root}/run", f"{root}/report", f"{root}/result", f"{root}/host")
    return [
        _rule(f"listen:{name}", ["ingress"], _LISTEN, keys),
        _rule(f"hear:{name}", ["egress"], _HEAR, keys),
        _rule(f"speak:{name}", ["ingress"], ["put", "query"], [own]),
        _rule(f"audience:{name}", ["egress"], ["declare_subscriber"], [f"{root}/*/*/{Topic.ADVICE}"]),
    ]


def _sizes() -> Iterable[dict[str, Any]]:
    limits = {Topic.REPLY: REPLY_BYTES, Topic.EXCHANGE: EXCHANGE_BYTES, Topic.ADVICE: ADVICE_BYTES}
    for topic, size in limits.items():
        yield _limit(["put"], [f"{ROOT}/*/*/*/{topic}"], size)
    yield _limit(["put"], [EVERY_ORDER], MAX_ORDER_BYTES)
    yield _limit(["query"], _with_caches(f"{ROOT}/**"), QUESTION_BYTES)


def _rates(agents: Iterable[tuple[str, str]], advisers: Iterable[tuple[str, str]]) -> Iterable[dict[str, Any]]:
    """One for each key: a link has one clock for all keys of an expression."""
    keys = [f"{side}/{agent}/{topic}" for side, agent in agents for topic in _WRITES]
    keys += [f"{side}/{adviser}/{Topic.ADVICE}" for side, adviser in advisers]
    return ({"key_expr": f"{ROOT}/*/{key}", "freq": RATE_HZ} for key in keys)


def _limit(messages: Sequence[str], keys: Sequence[str], size: int) -> dict[str, Any]:
    return {"flows": ["ingress"], "messages": messages, "key_exprs": keys, "size_limit": size}


def _rule(name: str, flows: Sequence[str], messages: Sequence[str], keys: Sequence[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": flows, "messages": messages, "key_exprs": keys}


def _with_caches(*keys: str) -> list[str]:
    return [form for key in keys for form in (key, f"{key}/@adv/**")]
