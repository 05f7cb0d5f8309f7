"""The fallbacks for Windows that any platform can run; `make check` types the others as Windows has them."""

import asyncio
import os
import signal
import socket
from pathlib import Path

import pytest

from khala_protocol import platforms
from khala_protocol.signals import cancelled_by_signal, stop_on_signal


@pytest.fixture
def loop_without_signals(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have loops take no handlers of signals, as those of Windows do."""

    def refuse(*_: object) -> None:
        raise NotImplementedError

    monkeypatch.setattr("asyncio.unix_events._UnixSelectorEventLoop.add_signal_handler", refuse)


@pytest.mark.posix
@pytest.mark.usefixtures("loop_without_signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_a_signal_ends_work_where_the_loop_takes_no_handlers(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    asyncio.get_running_loop().call_soon(signal.raise_signal, number)
    try:
        assert await cancelled_by_signal(asyncio.Event().wait()) == number
    finally:
        signal.signal(number, before)


@pytest.mark.posix
@pytest.mark.usefixtures("loop_without_signals")
async def test_the_first_signal_gives_the_handlers_back(monkeypatch: pytest.MonkeyPatch) -> None:
    before = [signal.getsignal(number) for number in platforms.SIGNALS]
    stop = stop_on_signal()
    signal.raise_signal(signal.SIGTERM)
    await stop.wait()
    assert [signal.getsignal(number) for number in platforms.SIGNALS] == before


async def test_a_thread_reads_a_pipe_that_the_loop_cannot_wait_for() -> None:
    end, other = os.pipe()
    reader = asyncio.StreamReader()
    with os.fdopen(end, "rb") as pipe, os.fdopen(other, "wb", buffering=0) as writer:
        platforms.read_in_thread(pipe, reader)
        writer.write(b"a job\n")
        assert await reader.readline() == b"a job\n"
        writer.close()
        assert await reader.readline() == b""


def test_a_connection_that_is_reset_on_close_says_so_to_its_peer() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection(server.getsockname()) as peer:
        accepted, _ = server.accept()
        platforms.reset_on_close(accepted)
        accepted.close()
        with pytest.raises(ConnectionResetError):
            peer.recv(1)


def test_what_is_not_there_is_nobodys(tmp_path: Path) -> None:
    assert platforms.is_mine(tmp_path)
    assert not platforms.is_mine(tmp_path / "missing")


@pytest.mark.posix
def test_a_file_is_open_to_others_if_its_mode_says_so(tmp_path: Path) -> None:
    (tmp_path / "key").touch(0o600)
    assert not platforms.others_can_read(tmp_path / "key")
    (tmp_path / "key").chmod(0o640)
    assert platforms.others_can_read(tmp_path / "key")
