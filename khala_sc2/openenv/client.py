"""The client: a session of a server, with types.

    async with KhalaEnv("http://localhost:8000") as env:
        result = await env.reset(seed=1, task="2s3z")
        while not result.done:
            result = await env.step(KhalaAction(reply=decide(result.observation.text)))

`KhalaEnv(…).sync()` is the same without `await`. The token of a server stands in its address,
`http://khala:TOKEN@host:8000`, or in KHALA_OPENENV_TOKEN. The client needs `openenv-core`, and neither a game nor a
server.
"""

from __future__ import annotations

import contextlib
import os
from typing import Any, Self
from urllib.parse import quote

from openenv.core.client_types import StepResult
from openenv.core.env_client import EnvClient
from websockets.exceptions import ConnectionClosed

from khala_sc2.openenv.models import KhalaAction, KhalaObservation, KhalaState

__all__ = ["KhalaAction", "KhalaEnv", "KhalaObservation", "KhalaState"]


class KhalaEnv(EnvClient[KhalaAction, KhalaObservation, KhalaState]):
    """A session. `reset` takes the fields of `khala_sc2.openenv.models.ResetOptions`."""

    def __init__(self, base_url: str, *arguments: Any, **options: Any) -> None:
        """Take the address of a server; all else is as in `EnvClient`."""
        super().__init__(_with_token(base_url), *arguments, **options)

    async def __aenter__(self) -> Self:
        await self.connect()
        return self

    async def _send(self, message: dict[str, Any]) -> None:
        with contextlib.suppress(
            ConnectionClosed
        ):  # a server that is full says so, and closes: `_receive` has its words
            await super()._send(message)

    def _step_payload(self, action: KhalaAction) -> dict[str, Any]:
        return action.model_dump()

    def _parse_result(self, payload: dict[str, Any]) -> StepResult[KhalaObservation]:
        outside = {"reward": payload.get("reward"), "done": payload.get("done", False)}
        observation = KhalaObservation.model_validate(payload.get("observation", {}) | outside)
        return StepResult(observation=observation, **outside)

    def _parse_state(self, payload: dict[str, Any]) -> KhalaState:
        return KhalaState.model_validate(payload)


def _with_token(address: str) -> str:
    """Return an address with the token of the environment as its login, unless it has one."""
    token = os.environ.get("KHALA_OPENENV_TOKEN", "")
    scheme, separator, rest = address.rpartition("://")
    if not token or "@" in rest.partition("/")[0]:
        return address
    return f"{scheme}{separator}khala:{quote(token, safe='')}@{rest}"
