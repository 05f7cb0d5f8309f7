"""Log lines of the service, for people or as JSON: one object a line, with run, agent and step where they are known."""

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


def set_up(*, as_json: bool) -> None:
    """Log to stderr, from INFO on for the service itself."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonFormatter() if as_json else VisibleFormatter(TEXT))
    logging.basicConfig(level=logging.WARNING, handlers=[handler], force=True)
    logging.getLogger("khala.service").setLevel(logging.INFO)
