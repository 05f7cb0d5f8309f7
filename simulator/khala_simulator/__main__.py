"""The game process: what the launcher of an install executes.

It listens before it imports anything heavy, because PySC2 tries to connect 2 ms after the start and then once a
second: the time that numpy, protobuf and aiohttp take to load hides in that second. No HTTP is answered until the
endpoint exists; a client that connects early waits in the backlog (python-sc2 gives up at the first 404).

Above: `install.py`, which writes the launcher. Below: `server.py`.
"""

from __future__ import annotations

import os
import re
import signal
import socket
import sys
from typing import NamedTuple, NoReturn

_BUILD = re.compile(r"Base(\d+)")
_FLAGS = {"-listen", "-port", "-dataDir", "-tempDir", "-dataVersion", "-executable"}


class Arguments(NamedTuple):
    """The part of the game's command line that means something here."""

    host: str = "127.0.0.1"
    port: int = 5000
    data_dir: str = "."
    temp_dir: str | None = None
    data_version: str | None = None
    base_build: int = 75689


def parse(argv: list[str]) -> Arguments:
    """Read the game's command line; ignore flags that a headless game has no use for."""
    values = {flag: argv[i + 1] for i, flag in enumerate(argv[:-1]) if flag in _FLAGS}
    build = _BUILD.search(values.get("-executable", ""))
    return Arguments(
        host=values.get("-listen", Arguments().host).strip("[]"),
        port=int(values.get("-port", Arguments().port)),
        data_dir=values.get("-dataDir", Arguments().data_dir),
        temp_dir=values.get("-tempDir"),
        data_version=values.get("-dataVersion"),
        base_build=int(build[1]) if build else Arguments().base_build,
    )


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that already accepts connections, on an IPv4 or IPv6 literal.

    Raises:
        OSError: the address is not free or not of this machine.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    sock = socket.socket(family, socket.SOCK_STREAM)
    if sys.platform != "win32":  # there a socket may listen where another one did, and the option would mean theft
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    sock.bind((host, port))
    sock.listen()
    sock.setblocking(False)
    return sock


def _leave(*_: object) -> NoReturn:
    # In the middle of a thousand steps the event loop would notice the signal too late, and PySC2 kills after 3 s.
    # There is nothing to save: files are written as soon as a client asks for them.
    os._exit(0)


def main(argv: list[str] | None = None) -> None:
    """Serve one game until a client says quit, or SIGTERM does."""
    signal.signal(signal.SIGTERM, _leave)
    signal.signal(signal.SIGINT, _leave)
    try:
        arguments = parse(sys.argv[1:] if argv is None else argv)
    except ValueError as error:
        sys.exit(f"StarCraft II simulator: -port needs a number: {error}")
    try:
        sock = listen(arguments.host, arguments.port)
    except (OSError, OverflowError) as error:
        sys.exit(f"StarCraft II simulator: cannot listen on {arguments.host}:{arguments.port}: {error}")
    from khala_simulator.process.parent_watch import end_with_parent  # noqa: PLC0415  # after the socket listens

    end_with_parent()
    from khala_simulator.process.server import run  # noqa: PLC0415  # after the socket listens, see above

    run(
        sock,
        data_dir=arguments.data_dir,
        base_build=arguments.base_build,
        data_version=arguments.data_version,
    )


if __name__ == "__main__":
    main()
