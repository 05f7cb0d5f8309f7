"""Processes of the game that wait for a match, without a game."""

from __future__ import annotations

import os
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest
from websocket._http import proxy_info
from websocket._url import get_proxy_info

from khala_bridge.game.processes import IdleGames, no_proxy, pointed_to

SC2 = Path("/sc2")


class Process:
    """What PySC2 has of a process of the game."""

    def __init__(self, *, running: bool = True, leaves: bool = True) -> None:
        self.running, self.leaves = running, leaves
        self.closed = False
        self.controller = SimpleNamespace(leave=self._leave)

    def _leave(self) -> None:
        if not self.leaves:
            raise ConnectionError

    def close(self) -> None:
        self.closed = True


def test_the_process_that_waited_least_is_taken_by_a_match_of_its_install() -> None:
    games, first, second = IdleGames(most=2), Process(), Process()
    assert games.take(SC2) is None
    assert games.keep(first, SC2)
    assert games.keep(second, SC2)
    assert games.take(Path("/another")) is None
    assert [games.take(SC2), games.take(SC2), games.take(SC2)] == [second, first, None]


@pytest.mark.parametrize("process", [Process(running=False), Process(leaves=False)], ids=["dead", "cannot leave"])
def test_what_cannot_be_played_on_is_left_to_its_taker(process: Process) -> None:
    assert not IdleGames().keep(process, SC2)
    assert not process.closed


def test_no_more_wait_than_there_is_room_for_and_none_after_the_end() -> None:
    waits = Process()
    with closing(IdleGames(most=1)) as games:
        assert games.keep(waits, SC2)
        assert not games.keep(Process(), SC2)
    assert waits.closed
    assert not games.keep(Process(), SC2)


def test_a_process_that_died_while_it_waited_is_not_taken() -> None:
    games, process = IdleGames(), Process()
    games.keep(process, SC2)
    process.running = False
    assert games.take(SC2) is None
    assert process.closed


# --- proxies ------------------------------------------------------------------------------------------

PROXIES = ["http://127.0.0.1:1", "http://me:secret@proxy.example:3128", "socks5://127.0.0.1:1"]
VARIABLES = ["HTTP_PROXY", "http_proxy", "HTTPS_PROXY", "https_proxy", "ALL_PROXY", "all_proxy"]


def proxy_of(host: str) -> str | None:
    """Return the proxy through which PySC2's client would connect to a game."""
    found = proxy_info()  # type: ignore[no-untyped-call]  # see below
    return get_proxy_info(host, False, found.proxy_host, found.proxy_port, found.auth, found.no_proxy)[0]  # type: ignore[no-any-return]  # untyped


@pytest.mark.parametrize("given", [None, "", "corp.example", "corp.example,10.0.0.0/8"])
@pytest.mark.parametrize("proxy", PROXIES)
def test_no_proxy_stands_between_pysc2_and_its_game(
    proxy: str, given: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("no_proxy", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)
    if given is not None:
        monkeypatch.setenv("NO_PROXY", given)
    for name in VARIABLES:
        monkeypatch.setenv(name, proxy)
    before = dict(os.environ)
    hosts = ["127.0.0.1", "127.0.0.9", "::1", "localhost"]
    assert all(proxy_of(host) for host in hosts), "what PySC2 would do by itself"
    for scope in (no_proxy, lambda: pointed_to(SC2)):
        with scope():
            assert [proxy_of(host) for host in hosts] == [None] * 4
            assert proxy_of("game.example"), "another machine's may be needed"
            if given:
                assert proxy_of("corp.example") is None, "what the user wrote still counts"
        assert dict(os.environ) == before
