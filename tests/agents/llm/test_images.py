"""Pictures in requests: exactly the forms of OpenAI and of Anthropic."""

from __future__ import annotations

import hashlib
import json
from base64 import b64encode
from typing import TYPE_CHECKING, Any

import pytest
from aiohttp import web
from pydantic import SecretStr

from khala_agents.llm.anthropic import Anthropic
from khala_agents.llm.client import Request, prompt_sha256
from khala_agents.llm.openai_compatible import OpenAICompatible
from khala_agents.llm.pricing import Prices
from khala_agents.llm.profiles import PROFILES
from khala_agents.scripted.endpoint import TOKENS_PER_IMAGE, Endpoint, count_tokens
from khala_protocol.messages import ChatMessage, ImageRef

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from khala_agents.llm.client import LLMClient

SCREEN, MINIMAP = b"\xff\xd8\xffscreen", b"\x89PNG minimap"
PICTURES = {hashlib.sha256(data).hexdigest(): data for data in (SCREEN, MINIMAP)}


def ref(data: bytes, media_type: Any, title: str) -> ImageRef:
    digest = hashlib.sha256(data).hexdigest()
    return ImageRef(
        name=title[:4], media_type=media_type, sha256=digest, title=title, width=512, height=512, bytes=len(data)
    )


PROMPT = (
    ChatMessage(role="system", content="You are an agent."),
    ChatMessage(
        role="user",
        content="Game\n    Time: 0:07\n",
        images=(ref(SCREEN, "image/jpeg", "The screen."), ref(MINIMAP, "image/png", "The minimap.")),
    ),
)


class Server:
    """A server that notes the bodies of requests."""

    def __init__(self) -> None:
        self.bodies: list[Any] = []
        self.base_url = ""

    async def note(self, request: web.Request) -> web.Response:
        self.bodies.append(json.loads(await request.read()))
        openai = {"choices": [{"message": {"content": "ok"}}], "usage": None}
        return web.json_response(openai | {"content": [{"type": "text", "text": "ok"}]})


@pytest.fixture
async def server() -> AsyncIterator[Server]:
    made = Server()
    application = web.Application()
    application.router.add_route("*", "/{path:.*}", made.note)
    runner = web.AppRunner(application, shutdown_timeout=0.1)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", 0).start()
    made.base_url = f"http://127.0.0.1:{runner.addresses[0][1]}/v1"
    yield made
    await runner.cleanup()


async def ask(model: LLMClient, prompt: tuple[ChatMessage, ...] = PROMPT) -> str:
    try:
        return (await model.complete(Request(prompt, timeout_s=10, pictures=PICTURES))).text
    finally:
        await model.close()


@pytest.mark.parametrize("detail", ["auto", "low", "high"])
async def test_openai_gets_data_urls_each_behind_its_title(server: Server, detail: Any) -> None:
    model = OpenAICompatible(PROFILES["openai"], model="m", base_url=server.base_url, prices=Prices(), detail=detail)
    assert await ask(model) == "ok"
    assert server.bodies[0]["messages"] == [
        {"role": "system", "content": "You are an agent."},
        {
            "role": "user",
            "content": [
                {"type": "text", "text": "The screen."},
                {
                    "type": "image_url",
                    "image_url": {"url": f"data:image/jpeg;base64,{b64encode(SCREEN).decode()}", "detail": detail},
                },
                {"type": "text", "text": "The minimap."},
                {
                    "type": "image_url",
                    "image_url": {"url": f"data:image/png;base64,{b64encode(MINIMAP).decode()}", "detail": detail},
                },
                {"type": "text", "text": "Game\n    Time: 0:07\n"},
            ],
        },
    ]


async def test_anthropic_gets_sources_each_behind_its_title(server: Server) -> None:
    model = Anthropic(model="claude", prices=Prices(), key=SecretStr("sk-ant-0123"), base_url=server.base_url)
    assert await ask(model) == "ok"
    (body,) = server.bodies
    assert body["system"] == "You are an agent."
    assert body["messages"] == [
        {
            "role": "user",
            "content": [
                {"type": "text", "text": "The screen."},
                {
                    "type": "image",
                    "source": {
                        "type": "base64",
                        "media_type": "image/jpeg",
                        "data": b64encode(SCREEN).decode(),
                    },
                },
                {"type": "text", "text": "The minimap."},
                {
                    "type": "image",
                    "source": {
                        "type": "base64",
                        "media_type": "image/png",
                        "data": b64encode(MINIMAP).decode(),
                    },
                },
                {"type": "text", "text": "Game\n    Time: 0:07\n"},
            ],
        },
    ]


async def test_without_pictures_a_content_stays_a_text(server: Server) -> None:
    plain = tuple(message.model_copy(update={"images": ()}) for message in PROMPT)
    for model in (
        OpenAICompatible(PROFILES["openai"], model="m", base_url=server.base_url, prices=Prices()),
        Anthropic(model="claude", prices=Prices(), key=SecretStr("sk-ant-0123"), base_url=server.base_url),
    ):
        await ask(model, plain)
        assert server.bodies[-1]["messages"][-1] == {"role": "user", "content": PROMPT[1].content}


async def test_the_scripted_endpoint_reads_the_text_and_counts_the_pictures() -> None:
    seen = "Team A\n    Your units:\n        Stalker | tag 0x1 | screen [1, 1] | health 1/1\n"
    prompt = (ChatMessage(role="user", content=seen, images=PROMPT[1].images),)
    async with Endpoint() as endpoint:
        model = OpenAICompatible(
            PROFILES["scripted"], model="silent", base_url=endpoint.base_url, prices=Prices(prompt=0, completion=0)
        )
        completion = await model.complete(Request(prompt, timeout_s=10, pictures=PICTURES))
        await model.close()
    assert completion.text.startswith("Analysis: 1 team(s)")
    words = count_tokens("The screen.\nThe minimap.\n" + seen)
    assert completion.usage.prompt_tokens == words + 2 * TOKENS_PER_IMAGE


def test_prompts_with_other_pictures_have_another_hash() -> None:
    plain = tuple(message.model_copy(update={"images": ()}) for message in PROMPT)
    turned = (PROMPT[0], PROMPT[1].model_copy(update={"images": PROMPT[1].images[::-1]}))
    assert len({prompt_sha256(prompt) for prompt in (PROMPT, plain, turned)}) == 3
