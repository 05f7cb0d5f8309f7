"""A game process that answers at once, with what the simulator answered before: the floor that a client sets itself.

A client plays the simulator, whose answers go into a file. When it does the same again it gets those answers, in their
order, whatever it asks; so what its steps cost then is its own work and that of the socket.

A client starts such a process as its game, with `record` or `repeat`, the file, and the game's own arguments.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import os
import shlex
import socket
import struct
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Literal, TypeVar

from bench.paths import ROOT
from khala_simulator.__main__ import listen, parse
from khala_simulator.process.install import install
from khala_simulator.process.server import serve
from khala_simulator.process.session import Session

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

Mode = Literal["record", "repeat"]
Played = TypeVar("Played")

_KEY = b"sec-websocket-key:"
_GUID = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
"""What RFC 6455 adds to a client's key."""
_LENGTH = struct.Struct("<Q")


def floor(play: Callable[[], Played]) -> Played:
    """Return what `play` returns with a process that answers at once; it has to do the same each time.

    It starts a game by SC2PATH, plays, and closes it. It is called twice: the first time the simulator answers.
    """
    with tempfile.TemporaryDirectory() as directory:
        answers = Path(directory) / "answers"
        with _playing(Path(directory) / "recording", "record", answers):
            play()
        with _playing(Path(directory) / "repeating", "repeat", answers):
            return play()


@contextmanager
def _playing(directory: Path, mode: Mode, answers: Path) -> Iterator[None]:
    """Make clients start such a process while the block runs."""
    root = install(directory)
    for launcher in root.glob("Versions/Base*/SC2_x64"):
        command = shlex.join([sys.executable, "-m", "bench.simulator.at_once", mode, str(answers)])
        path = shlex.quote(str(ROOT))
        launcher.write_text(f'#!/bin/sh\nPYTHONPATH={path} exec {command} -executable "$0" "$@"\n')
    before = os.environ["SC2PATH"]
    os.environ["SC2PATH"] = str(root)
    try:
        yield
    finally:
        os.environ["SC2PATH"] = before


class _Recorded(Session):
    """A session that keeps its answers."""

    def __init__(self, data_dir: str, file: BinaryIO) -> None:
        super().__init__(data_dir)
        self._file = file

    async def answer(self, data: bytes) -> bytes:
        """Answer one request, and keep the answer."""
        answer = await super().answer(data)
        keep(self._file, answer)
        return answer


def keep(file: BinaryIO, answer: bytes) -> None:
    """Append an answer to a file of them; the game may be killed right after."""
    file.write(_LENGTH.pack(len(answer)) + answer)
    file.flush()


def record(sock: socket.socket, data_dir: str, answers: Path) -> None:
    """Serve the simulator until the client says quit, and keep all answers."""
    with answers.open("wb") as file:
        asyncio.run(serve(sock, _Recorded(data_dir, file)))


def repeat(sock: socket.socket, answers: Path) -> None:
    """Send one client the kept answers, one for each frame, until there are no more."""
    frames = [_frame(answer) for answer in _read(answers)]
    sock.setblocking(True)
    client, _ = sock.accept()
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    with client, client.makefile("rb") as stream:
        _shake_hands(client, stream)
        for frame in frames:
            if not _skip_frame(stream):
                return
            client.sendall(frame)


def _read(answers: Path) -> Iterator[bytes]:
    with answers.open("rb") as file:
        while head := file.read(_LENGTH.size):
            yield file.read(_LENGTH.unpack(head)[0])


def _shake_hands(client: socket.socket, stream: BinaryIO) -> None:
    key = b""
    while (line := stream.readline().strip()) != b"":
        if line.lower().startswith(_KEY):
            key = line[len(_KEY) :].strip()
    accept = base64.b64encode(hashlib.sha1(key + _GUID, usedforsecurity=False).digest())
    switch = b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    client.sendall(switch + b"Sec-WebSocket-Accept: " + accept + b"\r\n\r\n")


def _frame(data: bytes) -> bytes:
    """Return a whole binary message as one frame of a server."""
    if len(data) < 126:
        return struct.pack(">BB", 0x82, len(data)) + data
    if len(data) < 1 << 16:
        return struct.pack(">BBH", 0x82, 126, len(data)) + data
    return struct.pack(">BBQ", 0x82, 127, len(data)) + data


def _skip_frame(stream: BinaryIO) -> bool:
    """Read a client's frame, which is masked, and forget it; return whether there was one."""
    head = stream.read(2)
    if len(head) < 2:
        return False
    size = head[1] & 0x7F
    if size >= 126:
        size = int.from_bytes(stream.read(2 if size == 126 else 8), "big")
    return len(stream.read(4 + size)) == 4 + size


def answer() -> None:
    """Be the game process."""
    mode, answers, *rest = sys.argv[1:]
    arguments = parse(rest)
    sock = listen(arguments.host, arguments.port)
    if mode == "record":
        record(sock, arguments.data_dir, Path(answers))
    else:
        repeat(sock, Path(answers))


if __name__ == "__main__":
    answer()
