"""Log lines of processes that play matches, for people or as JSON: one object a line, with run, agent and step."""

from __future__ import annotations

import json
import logging
import sys
from datetime import UTC, datetime

from khala_protocol.visible import VisibleFormatter

here: dict[str, str | int] = {}
"""What all lines of this process are about: a worker's run and step."""
PLACES = ("run", "agent", "step")
TEXT = "%(asctime)s %(levelname)s %(name)s: %(message)s"


class JsonFormatter(logging.Formatter):
    """Formats a record as a JSON object; `extra=` of a call may hold run, agent and step."""

    def format(self, record: logging.LogRecord) -> str:
        """Return one line."""
        line = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname,
            "logger": record.name,
            "message": record.getMessage(),
            **{name: here[name] for name in PLACES if name in here},
            **{name: getattr(record, name) for name in PLACES if hasattr(record, name)},
        }
        if record.exc_info:
            line["error"] = self.formatException(record.exc_info)
        return json.dumps(line, default=str)


def set_up(*, as_json: bool = False) -> None:
    """Log to stderr what a person should know."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonFormatter() if as_json else VisibleFormatter(TEXT))
    logging.basicConfig(level=logging.WARNING, handlers=[handler], force=True)
    logging.getLogger("absl").setLevel(logging.ERROR)  # PySC2 warns at each step of abilities that it has no name for
