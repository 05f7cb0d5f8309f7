"""How the first implementation asks its agents, as a baseline: threads that poll.

It starts a thread per agent; in it, a second thread makes a blocking HTTP request, and the first looks for its result
every 50 ms (the original: every 100 ms). The main loop looks for finished agents every millisecond. No bus, no
other process: it measures the cost of threads and polling. Observations and the handling of replies are ours.
"""

from __future__ import annotations

import http.client
import json
import threading
import time
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

POLL_S = 0.05
HOST_POLL_S = 0.001


class _Agent:
    """One agent of the original: a flag that says whether it waits, and a text that appears at some time."""

    def __init__(self, base_url: str, model: str) -> None:
        self._url = urlsplit(base_url)
        self._model = model
        self.waiting = False
        self.answer: str | None = None

    def query(self, text: str) -> None:
        response: list[str] = []
        request = threading.Thread(target=lambda: response.append(self._post(text)))
        request.start()
        while not response:
            time.sleep(POLL_S)
        self.answer = response[0]
        self.waiting = False

    def _post(self, text: str) -> str:
        body = json.dumps({"model": self._model, "messages": [{"role": "user", "content": text}]})
        connection = http.client.HTTPConnection(self._url.hostname or "127.0.0.1", self._url.port)
        try:
            connection.request("POST", self._url.path + "/chat/completions", body, {"Content-Type": "application/json"})
            content: str = json.loads(connection.getresponse().read())["choices"][0]["message"]["content"]
            return content
        finally:
            connection.close()


def step_s(
    base_url: str, model: str, build: Callable[[], Iterable[str]], act: Callable[[list[str]], object], steps: int
) -> list[float]:
    """Return the wall time of each step, in seconds.

    Args:
        base_url: of the endpoint.
        model: its model.
        build: makes the text of one agent after the other, as the original does before it starts the agent's thread.
        act: gets all replies.
        steps: how many to measure.
    """
    agents: list[_Agent] = []
    times = []
    for _ in range(steps):
        began = time.perf_counter()
        for number, text in enumerate(build()):
            if number == len(agents):
                agents.append(_Agent(base_url, model))
            agents[number].waiting = True
            threading.Thread(target=agents[number].query, args=(text,)).start()
        while any(agent.waiting for agent in agents):
            time.sleep(HOST_POLL_S)
        act([agent.answer or "" for agent in agents])
        times.append(time.perf_counter() - began)
    return times
