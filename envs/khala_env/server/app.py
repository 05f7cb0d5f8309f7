"""The server as `openenv.yaml` names it: `khala openenv` with its defaults, for `uvicorn server.app:app`.

It is for programs of its own machine. To let others play, set KHALA_OPENENV_TOKEN, or KHALA_OPENENV_OPEN=1 for
everybody who reaches it. `python -m server.app` does not close the websockets of trainers that think for minutes;
`uvicorn` does, unless `--ws-ping-interval` and `--ws-ping-timeout` are longer than they think.
"""

from __future__ import annotations

import argparse
import os

import uvicorn

from khala_protocol.listening import bind
from khala_sc2.openenv.server import OPENENV_OPEN, app_of, openenv_door, server_config

app = app_of(door=openenv_door(is_open=os.environ.get(OPENENV_OPEN, "") not in {"", "0", "false"}))


def main() -> None:
    """Serve until a signal comes."""
    parser = argparse.ArgumentParser(description="Serve Khala by OpenEnv; `khala openenv` has more options.")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=8000)
    given = parser.parse_args()
    with bind(given.host, given.port) as listening:
        uvicorn.Server(server_config(app)).run(sockets=[listening])


if __name__ == "__main__":
    main()
