"""Look at this machine as a match would, and say how to fix what is wrong.

Each check is a function that returns a `Finding`; none changes anything or needs a network beyond this machine.
"""

from __future__ import annotations

import importlib.metadata
import os
import platform
import socket
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from khala_protocol.visible import visible_line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from khala_protocol.bus.certificate import Certificate

State = Literal["ok", "note", "wrong"]
PORTS = {7447: "the router of `khala router`"}


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check.

    Attributes:
        state: `wrong` keeps a match from starting; a `note` is worth knowing.
        advice: what to do, empty if nothing.
    """

    name: str
    state: State
    found: str
    advice: str = ""

    def as_dict(self) -> dict[str, str]:
        """Return it as data for JSON."""
        return asdict(self)


def examine(tls: Path | None = None, game: str | None = None) -> Iterator[Finding]:
    """Run every check, in the order in which a newcomer would ask; of certificates and of a game if they are named."""
    usual = [check for check in CHECKS if not (game and check is _game)]  # the game that is named counts, no other
    for check in (*usual, *([_certificates_in(tls)] if tls else []), *([_game_process(game)] if game else [])):
        try:
            yield from check()
        except Exception as error:  # noqa: BLE001  # one check that breaks must not hide the others
            yield Finding(
                getattr(check, "__name__", "certificates").strip("_"),
                "wrong",
                f"{type(error).__name__}: {error}",
                "report this",
            )


def _python() -> Iterator[Finding]:
    yield Finding("Python", "ok", f"{platform.python_version()} on {platform.system()} {platform.machine()}")


def _pysc2() -> Iterator[Finding]:
    try:
        from khala_bridge import compat  # noqa: PLC0415  # half a second that only this check needs
    except ImportError as error:
        yield Finding("PySC2", "wrong", str(error), "run `make install`, or `uv sync`: it keeps enum34 out")
        return
    yield Finding("PySC2", "ok", importlib.metadata.version("pysc2"))
    kind = compat.protobuf_kind()
    version = importlib.metadata.version("protobuf")
    if kind == "upb":
        yield Finding("protobuf", "ok", f"{version} ({kind})")
    else:
        advice = (
            "unset PROTOCOL_BUFFERS_PYTHON_IMPLEMENTATION and install a protobuf wheel: this one is 80 times slower"
        )
        yield Finding("protobuf", "note", f"{version} ({kind})", advice)


def _game() -> Iterator[Finding]:
    from khala_simulator.process.install import is_installed  # noqa: PLC0415

    given = os.environ.get("SC2PATH")
    if given is None:
        yield Finding(
            "game", "ok", "the simulator (SC2PATH is not set)", "`khala run --game SC2PATH` plays the real one"
        )
        return
    root = Path(os.path.expanduser(given))  # noqa: PTH111  # Path's raises for a user that is not there
    if not list(root.glob("Versions/Base*/SC2*")):
        advice = "point SC2PATH to a StarCraft II install, or make one of the simulator with `khala sc2 install DIR`"
        yield Finding("game", "wrong", f"SC2PATH={given} holds no Versions/Base…/SC2_x64", advice)
        return
    what = "the simulator" if is_installed(root) else "StarCraft II"
    yield Finding("game", "ok", f"{what} in {root}")
    maps = sum(1 for _ in root.glob("Maps/*/*.SC2Map"))
    advice = "" if maps else "put the maps below Maps/llm_smac, Maps/mini_games, …"
    yield Finding("maps", "ok" if maps else "wrong", f"{maps} below {root / 'Maps'}", advice)


def _game_process(source: str) -> Callable[[], Iterator[Finding]]:
    def check() -> Iterator[Finding]:
        from khala_bridge.calibrate.survey import survey  # noqa: PLC0415
        from khala_bridge.errors import GameError  # noqa: PLC0415
        from khala_sc2.playing.environment import plain  # noqa: PLC0415  # only this check needs them
        from khala_sc2.playing.games import find  # noqa: PLC0415

        try:
            path, name = find(source)
            found = survey(path, plain())
        except GameError as error:
            yield Finding("game process", "wrong", str(error), "docs/how-to/real-game.md says what it needs")
            return
        yield Finding("game process", "ok", f"{name} {found.version}, build {found.build}, answers")
        yield Finding("maps that load", "ok" if found.loaded else "wrong", _first_names(found.loaded), "")
        for map_name, why in found.refused.items():
            yield Finding(f"map {map_name}", "note", why, "tasks on this map cannot be played with this game")
        if found.absent:
            yield Finding(
                "maps not there",
                "note",
                _first_names(found.absent),
                "put them below Maps; docs/reference/maps.md lists all",
            )
        advice = "" if found.renders else "pictures come from feature layers; a game without a graphics card draws none"
        yield Finding("rendering", "ok" if found.renders else "note", found.rendering, advice)

    return check


def _first_names(names: Sequence[str]) -> str:
    more = f" and {len(names) - 8} more" if len(names) > 8 else ""
    return f"{len(names)}: {', '.join(names[:8])}{more}" if names else "none"


def _engine() -> Iterator[Finding]:
    from khala_simulator.native import engine  # noqa: PLC0415

    try:
        engine.check()
    except (ImportError, ValueError) as error:
        yield Finding("engine", "wrong", str(error), f"unset {engine.VARIABLE}, or say make install")
        return
    if engine.engine() == "compiled" or engine.request() == "python":
        yield Finding("engine", "ok", engine.describe())
        return
    advice = "the interpreter plays the rules, a hundred times slower: `make install` with a network compiles them"
    yield Finding("engine", "note", engine.describe(), advice)


def _bus() -> Iterator[Finding]:
    yield Finding("Zenoh", "ok", importlib.metadata.version("eclipse-zenoh"))
    for port, user in PORTS.items():
        try:
            socket.create_server(("127.0.0.1", port)).close()
        except OSError as error:
            yield Finding(f"port {port}", "note", os.strerror(error.errno or 0), f"{user} needs another one: --listen")
        else:
            yield Finding(f"port {port}", "ok", f"free for {user}")


def _certificates_in(directory: Path) -> Callable[[], Iterator[Finding]]:
    def certificates() -> Iterator[Finding]:
        from khala_protocol import certificates  # noqa: PLC0415  # only this check needs the library
        from khala_protocol.errors import BusError  # noqa: PLC0415  # likewise

        try:
            found = certificates.certificates(directory)
        except BusError as error:
            yield Finding("certificates", "wrong", str(error), "copy it again, or make it anew with `khala keys`")
            return
        if not found:
            yield Finding("certificates", "wrong", f"none in {directory}", "`khala keys init DIR` makes them")
        yield from map(_certificate, found)

    return certificates


def _certificate(certificate: Certificate) -> Finding:
    state: State = "ok"
    advice = ""
    if certificate.is_open:
        state = "note"
        advice = f"chmod 600 {certificate.key}: others can read it"
    if certificate.warning:
        state = "note"
        advice = certificate.remedy
    said = f"valid for {certificate.days_left} days, until {certificate.ends:%Y-%m-%d}"
    if certificate.has_expired:
        state = "wrong"
        said = f"expired on {certificate.ends:%Y-%m-%d}"
    return Finding(f"certificate {certificate.name}", state, said, advice)


def keys() -> Iterator[Finding]:
    """Yield which keys of the shipped model files are set."""
    from khala_agents.config import load_model, model_files  # noqa: PLC0415  # only two checks need them

    variables = dict.fromkeys(load_model(name).api_key_env for name in model_files())
    given = [name for name in variables if name and (os.environ.get(name) or os.environ.get(f"{name}_FILE"))]
    if given:
        yield Finding("model keys", "ok", ", ".join(given) + " set")
    else:
        yield Finding(
            "model keys",
            "note",
            "none set",
            "the scripted model and local servers need none; see docs/how-to/your-model.md",
        )


def _network() -> Iterator[Finding]:
    from khala_agents.config import load_model, model_files  # noqa: PLC0415  # only two checks need them
    from khala_agents.llm.address import checked_address  # noqa: PLC0415
    from khala_agents.llm.network import find_trust, proxy_for  # noqa: PLC0415
    from khala_protocol.errors import ConfigError  # noqa: PLC0415

    ways: dict[str, list[str]] = {}
    for name in model_files():
        model = load_model(name)
        address = (os.environ.get(model.base_url_env) if model.base_url_env else None) or model.base_url
        try:
            proxy = proxy_for(checked_address(address))
        except (ConfigError, ValueError) as error:
            yield Finding(f"proxy for {name}", "note", visible_line(str(error)))
            continue
        ways.setdefault(str(proxy) if proxy else "", []).append(name)
    direct = ways.pop("", [])
    for shown, names in ways.items():
        advice = "set NO_PROXY for those that it cannot reach; this machine never needs a proxy"
        yield Finding("proxy", "ok", f"{visible_line(shown)} for {', '.join(names)}", advice)
    if direct:
        yield Finding("no proxy", "ok", f"for {', '.join(direct)}")
    try:
        trust = find_trust()
    except ConfigError as error:
        yield Finding("trusted certificates", "note", visible_line(str(error)), "name what is there, or unset it")
        return
    yield Finding("trusted certificates", "ok", visible_line(str(trust)) if trust else "those of the package certifi")


CHECKS: tuple[Callable[[], Iterator[Finding]], ...] = (_python, _pysc2, _game, _engine, _bus, keys, _network)
