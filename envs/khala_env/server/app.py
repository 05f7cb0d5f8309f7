"""The server as `openenv.yaml` names it: `khala openenv` with its defaults, for `uvicorn server.app:app`."""

from __future__ import annotations

import argparse

import uvicorn

from khala.openenv.server import app_of

app = app_of()


def main() -> None:
    """Serve until a signal comes."""
    parser = argparse.ArgumentParser(description="Serve Khala by OpenEnv; `khala openenv` has more options.")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=8000)
    given = parser.parse_args()
    uvicorn.run(app, host=given.host, port=given.port)


if __name__ == "__main__":
    main()
