"""The endpoint of a scripted model, in a process of its own."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextlib.contextmanager
def endpoint(latency_s: float) -> Iterator[str]:
    """Yield the base URL of an endpoint that answers after this time."""
    command = [sys.executable, "-m", "khala_sc2", "llm", "--port", "0", "--json", "--latency", str(latency_s)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as llm:
        try:
            assert llm.stdout is not None
            yield str(json.loads(llm.stdout.readline())["base_url"])
        finally:
            llm.terminate()
