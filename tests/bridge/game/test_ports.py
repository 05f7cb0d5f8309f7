"""Ports of the game: free, in a row, and none that an outgoing connection may take."""

from __future__ import annotations

import socket
from pathlib import Path

import portpicker
import pytest

from khala_bridge.errors import GameError
from khala_bridge.game import ports
from khala_bridge.game.ports import pick_port, pick_ports

EPHEMERAL = Path("/proc/sys/net/ipv4/ip_local_port_range")


def test_ports_are_free_in_a_row_and_below_those_of_outgoing_connections() -> None:
    found = pick_ports(6)
    assert found == list(range(found[0], found[0] + 6))
    for port in found:
        with socket.socket() as door:
            door.bind(("127.0.0.1", port))
    lowest = int(EPHEMERAL.read_text().split()[0]) if EPHEMERAL.exists() else 32768
    assert found[-1] < lowest


def test_ports_that_are_taken_are_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ports, "_RANGE", range(20_000, 20_004))
    monkeypatch.setattr(portpicker, "is_port_free", lambda port: port != 20_001)
    assert pick_ports(2) == [20_002, 20_003]
    assert {pick_port() for _ in range(200)} == {20_000, 20_002, 20_003}
    with pytest.raises(GameError, match="no 3 free ports in a row from 20000 to 20003"):
        pick_ports(3)
