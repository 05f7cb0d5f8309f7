"""A process ends with the parent that named itself, and no other does."""

from __future__ import annotations

import subprocess
import sys

import psutil
import pytest

CHILD = """
import {signal}, time
from khala_protocol.parent_watch import PARENT, end_with_parent
import os
end_with_parent()
assert PARENT not in os.environ
print(os.getpid(), flush=True)
time.sleep(3600)
"""
STUBBORN = "signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); import os"
PARENT = """
import subprocess, sys
from khala_protocol.parent_watch import named_parent
import os
names = named_parent() if sys.argv[2] == "named" else {}
subprocess.run([sys.executable, "-c", sys.argv[1]], env=os.environ | names)
"""


def ended_within_s(how: str, child: str, seconds: float) -> bool:
    """Kill the parent of a process, and return whether the process has ended after so many seconds."""
    with subprocess.Popen([sys.executable, "-c", PARENT, child, how], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        child_process = psutil.Process(pid)
        parent.kill()
        try:
            child_process.wait(seconds)
        except psutil.TimeoutExpired:
            child_process.kill()
            return False
    return True


@pytest.mark.parametrize("imports", ["os", STUBBORN], ids=["in order", "against its will"])
def test_a_process_ends_with_the_parent_that_named_itself(imports: str) -> None:
    assert ended_within_s("named", CHILD.replace("{signal}", imports), 2.0)


def test_a_process_outlives_a_parent_that_did_not() -> None:
    assert not ended_within_s("unnamed", CHILD.replace("{signal}", "os"), 0.6)
