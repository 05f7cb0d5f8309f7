"""A row → one chat, in the form of OpenAI's fine-tuning, of ShareGPT, and of TRL's prompts and completions.

A prompt has replies, too: that of the worked example, and those of earlier steps. Each decision is a row of its own, so
only the last reply of a row is to be trained on. In chats a `weight` says so: 1 for it, 0 for all others.

Texts stand there as they are, hostile ones too; the one exception is the placeholder of ShareGPT's pictures, which
would be counted as a picture where a text has it.
"""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from khala_protocol.messages import ChatMessage
    from khala_sc2.dataset.row import Row, RowPicture

_FROM = {"system": "system", "user": "human", "assistant": "gpt"}
PLACEHOLDER = "<image>"
BROKEN_PLACEHOLDER = "< image>"


def openai(row: Row, *, images: bool) -> dict[str, Any]:
    """Return a row in OpenAI's form.

    Args:
        row: of the data set.
        images: whether the data set has pictures: then each content is a list of parts, because a column has one type.
    """
    pictures = {picture.ref.sha256: picture for picture in row.pictures}
    asked = [
        {"role": message.role, "content": _content(message, pictures, images=images), **_weight(message)}
        for message in row.prompt
    ]
    said = [_text(row.reply)] if images else row.reply
    return {"messages": [*asked, {"role": "assistant", "content": said, "weight": 1}]}


def _weight(message: ChatMessage) -> dict[str, int]:
    """Return the weight of a message of the prompt; only replies have one."""
    return {"weight": 0} if message.role == "assistant" else {}


def trl(row: Row, *, images: bool) -> dict[str, Any]:
    """Return a row as TRL's conversational prompt and completion, with its id.

    Args:
        row: of the data set.
        images: whether the data set has pictures: then each content is a list of parts, and `images` has the pictures
            of its parts of type `image`, in their order.
    """
    shown = {picture.ref.sha256 for picture in row.pictures}
    asked = [{"role": message.role, "content": _parts(message, shown, images=images)} for message in row.prompt]
    said = [_text(row.reply)] if images else row.reply
    return {"id": row.id, "prompt": asked, "completion": [{"role": "assistant", "content": said}]}


def _parts(message: ChatMessage, shown: set[str], *, images: bool) -> str | list[dict[str, Any]]:
    if not images:
        return message.content
    refs = [ref for ref in message.images if ref.sha256 in shown]
    above = [part for ref in refs for part in (_text(ref.title), {"type": "image"})]
    return [*above, _text(message.content)]


def _content(message: ChatMessage, pictures: dict[str, RowPicture], *, images: bool) -> str | list[dict[str, Any]]:
    """Return the content of a message: before each picture its title, and the text after them, as a model got it."""
    if not images:
        return message.content
    parts: list[dict[str, Any]] = []
    for ref in message.images:
        if picture := pictures.get(ref.sha256):
            url = f"data:{ref.media_type};base64,{b64encode(picture.data).decode()}"
            parts += [_text(ref.title), {"type": "image_url", "image_url": {"url": url}}]
    return [*parts, _text(message.content)]


def _text(words: str) -> dict[str, Any]:
    return {"type": "text", "text": words}


def sharegpt(row: Row, *, images: bool) -> dict[str, Any]:
    """Return a row in ShareGPT's form, with what it is; pictures are named by their files.

    Args:
        row: of the data set.
        images: whether the data set has pictures.
    """
    shown = {picture.ref.sha256 for picture in row.pictures}
    chat = [
        {"from": _FROM[message.role], "value": _value(message, shown, images=images), **_weight(message)}
        for message in row.prompt
    ]
    plain: dict[str, Any] = {
        "id": row.id,
        "conversations": [*chat, {"from": "gpt", "value": _value_of(row.reply, images=images), "weight": 1}],
        "task": row.task,
        "variant": row.variant,
        "seed": row.seed,
        "model": row.model,
        "status": row.status,
        "outcome": row.outcome,
    }
    return plain | ({"images": [f"images/{picture.file_name}" for picture in row.pictures]} if images else {})


def _value(message: ChatMessage, shown: set[str], *, images: bool) -> str:
    refs = [ref for ref in message.images if ref.sha256 in shown] if images else []
    above = "".join(f"{_value_of(ref.title, images=images)}\n{PLACEHOLDER}\n" for ref in refs)
    return above + _value_of(message.content, images=images)


def _value_of(words: str, *, images: bool) -> str:
    return break_placeholders(words) if images else words


def break_placeholders(words: str) -> str:
    """Return a text in which no word counts as a picture of ShareGPT's form."""
    return words.replace(PLACEHOLDER, BROKEN_PLACEHOLDER)
