"""The process that answers at once: it sends what was kept, frame by frame, and leaves when there is no more."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import pytest
import websocket

from bench.simulator.at_once import keep, repeat
from khala_simulator.__main__ import listen

if TYPE_CHECKING:
    from pathlib import Path

ANSWERS = [b"short", b"x" * 300, b"y" * 70_000]
"""One for each of the three ways to write the length of a frame."""


@pytest.mark.timeout(30)
def test_every_request_gets_the_answer_of_its_turn(tmp_path: Path) -> None:
    kept = tmp_path / "answers"
    with kept.open("wb") as file:
        for answer in ANSWERS:
            keep(file, answer)
    sock = listen("127.0.0.1", 0)
    server = threading.Thread(target=repeat, args=(sock, kept))
    server.start()
    client = websocket.create_connection(f"ws://127.0.0.1:{sock.getsockname()[1]}/sc2api")
    got = []
    for request in (b"a", b"b" * 200, b"c" * 70_000):
        client.send_binary(request)
        got.append(client.recv())
    assert got == ANSWERS
    server.join()
    client.close()
    sock.close()
