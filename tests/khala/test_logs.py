"""Log lines of processes that play matches."""

from __future__ import annotations

import json
import logging

from khala_sc2.playing import logs


def test_a_log_line_is_json_with_run_agent_and_step() -> None:
    error = ValueError("broken")
    about = (type(error), error, None)
    record = logging.LogRecord("khala_sc2.service", logging.WARNING, "", 1, "late: %s", ("so\nlong",), about)
    record.agent, record.step = "blue/Stalkers", 3
    logs.here["run"] = "first"
    try:
        line = logs.JsonFormatter().format(record)
    finally:
        logs.here.clear()
    assert "\n" not in line
    said = json.loads(line)
    assert (said["run"], said["agent"], said["step"]) == ("first", "blue/Stalkers", 3)
    assert (said["message"], said["level"]) == ("late: so\nlong", "WARNING")
    assert "ValueError: broken" in said["error"]
