"""A model of inspect_ai as the client of an agent: its prompts, pictures and usage in the other's types.

Above: `khala_sc2.inspect.team`. Tries, limits and caches are inspect_ai's own, and each request is in its transcript.
"""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING

from inspect_ai.model import ChatMessageAssistant, ChatMessageSystem, ChatMessageUser, ContentImage, ContentText

from khala_agents.llm.client import Completion, model_name
from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Mapping

    from inspect_ai.model import ChatMessage as InspectMessage
    from inspect_ai.model import Content, Model, ModelUsage

    from khala_agents.llm.client import Request, Scalar
    from khala_protocol.messages import ChatMessage


class InspectClient:
    """A model of inspect_ai, as `khala_agents.llm.client.LLMClient` wants one."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self.model = str(model)
        self.endpoint = "inspect_ai"
        self.params: Mapping[str, Scalar] = {}
        self.answer_tokens: int | None = None

    async def complete(self, request: Request) -> Completion:
        """Return the model's words. Errors are inspect_ai's, and end the sample."""
        output = await self._model.generate([message_of(message, request.pictures) for message in request.messages])
        return Completion(
            text=output.completion,
            usage=usage_of(output.usage),
            finish=output.stop_reason,
            model=model_name(output.model),
        )

    async def check(self) -> None:
        """Do nothing: inspect_ai has looked for the key."""

    async def refresh(self) -> None:
        """Do nothing: connections are inspect_ai's."""

    async def close(self) -> None:
        """Do nothing: connections are inspect_ai's."""


def message_of(message: ChatMessage, pictures: Mapping[str, bytes]) -> InspectMessage:
    """Return a message of a prompt, its pictures before its text, each below its title.

    Args:
        message: of ours.
        pictures: bytes of all that it names, by their hashes.
    """
    if message.role == "system":
        return ChatMessageSystem(content=message.content)
    if message.role == "assistant":
        return ChatMessageAssistant(content=message.content)
    parts: list[Content] = []
    for image in message.images:
        data = b64encode(pictures[image.sha256]).decode()
        parts += [ContentText(text=image.title), ContentImage(image=f"data:{image.media_type};base64,{data}")]
    return ChatMessageUser(content=[*parts, ContentText(text=message.content)] if parts else message.content)


def usage_of(usage: ModelUsage | None) -> Usage:
    """Return what a request used; unknown if the model did not say."""
    if usage is None:
        return Usage(requests=1, unknown_requests=1)
    return Usage(
        requests=1,
        prompt_tokens=usage.input_tokens,
        completion_tokens=usage.output_tokens,
        cached_tokens=usage.input_tokens_cache_read or 0,
        cache_write_tokens=usage.input_tokens_cache_write or 0,
        reasoning_tokens=usage.reasoning_tokens or 0,
    )
