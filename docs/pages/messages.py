"""The page of the messages, from their models."""

from __future__ import annotations

import inspect
import re
from typing import TYPE_CHECKING

from pydantic import BaseModel

from docs.pages.markdown import anchor, code, fence, head, join, prose, table
from docs.pages.schema import Describer, about, parts, remarks
from khala_protocol import keys, messages
from khala_protocol.messages import HALLUCINATION_KINDS, MESSAGE_TYPES, Wire, reasons, to_all

if TYPE_CHECKING:
    from types import ModuleType

DESCRIBER = Describer()
LITERALS = {"AgentStatus": (to_all, "AgentReport.status"), "RejectionReason": (reasons, "Rejection.reason")}
"""Literals whose values have remarks, their module, and the field that holds one."""


def page() -> str:
    """Return the page of keys, messages, their parts, and single words."""
    return join(
        head("Messages", "`protocol/khala_protocol/messages` and `protocol/khala_protocol/keys.py`"),
        "UTF-8 JSON, one object a message, with its `kind`. Unknown fields are errors, and so is another major "
        "version `v`. How they are delivered: [the bus](../design/bus.md).",
        "## Keys",
        _keys(),
        table(("message", "about"), [(f"[{m.__name__}]({anchor(m.__name__)})", _first(m)) for m in MESSAGE_TYPES]),
        prose(_frames()),
        f"Every message has `v` (integer, {messages.SCHEMA_VERSION}), `run` (name of the run) and `kind` (its name in "
        "lower case); they are left out below.",
        *(_section(model, "##") for model in MESSAGE_TYPES),
        "## Parts",
        *(_section(model, "###") for model in parts(MESSAGE_TYPES)),
        "## Words",
        *(_words(module, name, field) for name, (module, field) in LITERALS.items()),
    )


def _section(model: type, level: str) -> str:
    if not issubclass(model, BaseModel):
        return join(f"{level} {model.__name__}", about(model), DESCRIBER.row(model))
    without = [*Wire.model_fields, "kind"] if issubclass(model, Wire) else []
    return join(f"{level} {model.__name__}", about(model), DESCRIBER.fields(model, without=without))


def _keys() -> str:
    """Return the forms of keys as their module draws them, and the allowed names."""
    _, forms, *rest = (inspect.getdoc(keys) or "").split("\n\n")
    refused = re.search(r"WrongKey: (.+)", inspect.getdoc(keys.check_name) or "")
    rule = f"A name is refused when {refused.group(1)}" if refused else ""
    return join(fence(inspect.cleandoc(forms)), prose("\n\n".join(rest)), rule)


def _first(model: type) -> str:
    """Return the first paragraph of a docstring."""
    return (inspect.getdoc(model) or "").split("\n\n", maxsplit=1)[0]


def _frames() -> str:
    """Return the package's text on frames and units."""
    return (inspect.getdoc(messages) or "").partition("provider is imported here. ")[2]


def _words(module: ModuleType, name: str, field: str) -> str:
    kinds: dict[str, str | None] = {}
    if field == "Rejection.reason":
        kinds |= {reason: judged.kind for reason, judged in HALLUCINATION_KINDS.items()}
    rows = [
        (code(value), remark, (kinds.get(value) or "").replace("_", "-")) for value, remark in remarks(module, name)
    ]
    return join(f"### {code(field)}", table(("value", "meaning", "hallucination"), rows))
