"""Sections about the last reply, and about talking to others."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from khala_bridge.observe.text.page import section
from khala_bridge.observe.text.words import INDENT, ago, one_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.observe.text.page import Page
    from khala_protocol.messages import CastView, Received, Rejection

_QUOTES = re.compile("'{3,}")


@section("last_actions")
def last_actions(page: Page) -> Iterator[str]:
    """Show the calls of the last reply that were carried out, and what became of casts."""
    heard = page.observation.heard
    fates = {cast.call: cast for cast in heard.casts}
    if heard.accepted or fates:
        yield "Your last actions"
    for call in heard.accepted:
        fate = fates.pop(call, None)
        yield f"{INDENT}accepted: {call}{_fate(fate) if fate else ''}"
    yield from (f"{INDENT}accepted before: {call}{_fate(fate)}" for call, fate in fates.items())


def _fate(cast: CastView) -> str:
    return f": {cast.end}" + (f", {cast.why}" if cast.why else "")


@section("rejections")
def rejections(page: Page) -> Iterator[str]:
    """Show the calls that were not carried out, and why."""
    if page.observation.heard.rejections:
        yield "Your last errors"
    yield from (f"{INDENT}{rejection_line(fault)}" for fault in page.observation.heard.rejections)


@section("messages")
def messages(page: Page) -> Iterator[str]:
    """Show the messages of others."""
    if page.observation.heard.messages:
        yield "Messages"
    yield from (
        f"{INDENT}{_message(message, page.observation.agent.name)}" for message in page.observation.heard.messages
    )


@section("communication")
def communication(page: Page) -> Iterator[str]:
    """Show the possible receivers of messages; the briefing says who they are and how to write to them."""
    if page.correspondents or page.channels:
        yield "Communication"
    if page.correspondents:
        yield f"{INDENT}You can write to: {', '.join(page.correspondents)}"
    if page.channels:
        yield f"{INDENT}Channels: {', '.join(page.channels)}"


def rejection_line(fault: Rejection) -> str:
    """Return a refusal as an agent reads it, on one line."""
    words = one_line(f"{fault.team} {fault.text}" if fault.team else fault.text)
    return f"rejected: {words}: {one_line(fault.message)}" if words else one_line(fault.message)


def _message(message: Received, name: str) -> str:
    """Return a message on one line and between quotes that it does not have, so that it cannot pass for other text."""
    where = "" if message.recipient == name else f" in {message.recipient}"
    lines = (one_line(line) for line in message.text.splitlines())
    text = _QUOTES.sub('"', " / ".join(line for line in lines if line))
    new = "" if message.again else ", new"
    age = "" if message.age_s is None else f"{new}, {ago(message.age_s)}"
    return f"Message from {message.sender}{where}{age}: '''{text}'''"
