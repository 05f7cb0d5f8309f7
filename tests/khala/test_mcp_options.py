"""The options of `khala mcp`: which seats are served, how, and what a wrong one says."""

from __future__ import annotations

import socket
import sys
from typing import TYPE_CHECKING, Any

import pytest

from khala_protocol.errors import ConfigError
from khala_sc2.mcp.commands import WantedSeats, run_mcp, table_of
from khala_sc2.playing.seats import Seat

if TYPE_CHECKING:
    from pathlib import Path


def wanted(
    tmp_path: Path, *seats: str, task: str | None = "duel_3m", port: int | None = None, **match: Any
) -> WantedSeats:
    given = {"seed": None, "episodes": None, "assemble_s": None, "max_wait_s": None, **match}
    return WantedSeats(task, seats, port, "silent", None, "simulator", None, tmp_path, given)


def test_options_choose_seats_and_their_time(tmp_path: Path) -> None:
    blue, red = Seat("blue", "Captain"), Seat("red", "Captain")
    alone = table_of(wanted(tmp_path))
    assert (alone.seats, alone.config.task.clock.max_wait_s) == ((blue,), None)
    assert table_of(wanted(tmp_path, "red/Captain", max_wait_s=60.0)).config.task.clock.max_wait_s == 60
    assert table_of(wanted(tmp_path, port=0)).seats == (blue, red)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"task": None}, "give a task, such as 2s3z_pair: `khala tasks` lists them"),
        ({"seats": ["Captain"]}, "--seat: there are blue/Captain and red/Captain: give one of"),
        ({"seats": ["Nobody"]}, "--seat: there is no Nobody: give one of blue/Captain, red/Captain"),
        ({"seats": ["red/Captain", "blue/Captain"]}, "--seat: over stdio one client plays one agent"),
    ],
)
def test_wrong_options_say_what_is_right(tmp_path: Path, given: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=f"^{says}"):
        run_mcp(wanted(tmp_path, *given.pop("seats", ()), **given))


def test_a_taken_port_is_said(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError, match=rf"^--port: cannot listen on 127.0.0.1:{port}: "):
            run_mcp(wanted(tmp_path, port=port))


def test_without_the_sdk_the_command_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "khala_sc2.mcp.serve", None)
    with pytest.raises(ConfigError, match=r"pip install 'khala-sc2\[mcp\]'$"):
        run_mcp(wanted(tmp_path))
