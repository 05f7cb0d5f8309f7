"""The program of a seat: one request to its model for each turn, from this process, without tools."""

from __future__ import annotations

import httpx
import verifiers.v1 as vf
from verifiers.v1.dialects.chat import message_to_wire

OK = 200


class KhalaHarness(vf.Harness[vf.HarnessConfig]):
    """Sends the prompt of a turn as it is, or behind all turns before (`KhalaData.history`)."""

    APPENDS_SYSTEM_PROMPT = True
    SUPPORTS_RESUME = True
    EXECUTES_CODE = False
    NEEDS_CONTAINER = False

    async def launch(
        self,
        ctx: vf.ModelContext,
        trace: vf.Trace,  # noqa: ARG002  # verifiers passes all by their names
        runtime: vf.Runtime,  # noqa: ARG002
        endpoint: str,
        secret: str,
        mcp_urls: dict[str, str],  # noqa: ARG002
        data: vf.TaskData,
    ) -> vf.ProgramResult:
        """Ask the model once; its answer is on the trace."""
        prompt = data.prompt if isinstance(data.prompt, list) else [vf.UserMessage(content=data.prompt or "")]
        system = [vf.SystemMessage(content=data.system_prompt)] if data.system_prompt else []
        body = {"model": ctx.model, "messages": [message_to_wire(message) for message in (*system, *prompt)]}
        async with httpx.AsyncClient(timeout=None) as http:  # noqa: S113  # verifiers has the limits
            answer = await http.post(
                f"{endpoint}/chat/completions", json=body, headers={"Authorization": f"Bearer {secret}"}
            )
        failed = answer.status_code != OK
        return vf.ProgramResult(exit_code=int(failed), stdout="", stderr=answer.text if failed else "")

    async def resume(
        self,
        ctx: vf.ModelContext,
        trace: vf.Trace,
        runtime: vf.Runtime,
        endpoint: str,
        secret: str,
        mcp_urls: dict[str, str],
        data: vf.TaskData,
        messages: vf.Messages,
        tool_interception_url: str | None = None,
    ) -> vf.ProgramResult:
        """Ask the model the next turn, without the turns before unless the row says so."""
        said = (ctx, trace, runtime, endpoint, secret, mcp_urls)
        if getattr(data, "history", True):
            return await super().resume(*said, data, messages, tool_interception_url)
        return await self.launch(*said, data.model_copy(update={"prompt": messages}))
