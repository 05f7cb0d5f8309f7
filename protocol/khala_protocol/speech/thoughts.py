"""The part of a reply in which an agent thinks: what stands before its first orders or messages.

Below it: `khala_protocol.speech.headings`, which knows what begins them.
"""

from __future__ import annotations

import re

from khala_protocol.messages import MAX_REPLY_CHARACTERS
from khala_protocol.reasoning import END, FINAL
from khala_protocol.speech.headings import ReplySection, heading_at
from khala_protocol.speech.marks import to_ascii
from khala_protocol.speech.whole import json_reply_of

_REASONED = re.compile(rf"{END}|{FINAL}", re.IGNORECASE)
_LINE = re.compile(r"^", re.MULTILINE)


def thought_of(reply: str) -> str:
    """Return what a reply says before the first heading of orders, messages or a team, without its own heading.

    A reasoning block belongs to it. It is all of the reply if there is no such heading.
    """
    if document := json_reply_of(reply):
        return document.analysis.strip()
    text = to_ascii(reply[:MAX_REPLY_CHARACTERS])
    reasoned = _REASONED.search(text)
    begin = 0
    end = len(text)
    for line in _LINE.finditer(text, reasoned.end() if reasoned else 0):
        heading = heading_at(text, line.start(), line_start=True)
        if heading is None:
            continue
        if heading.section is not ReplySection.ANALYSIS:
            end = line.start()
            break
        if not text[begin : line.start()].strip():
            begin = heading.end
    thought = reply[begin:end].strip()
    return thought.lstrip("*_# \n") if begin else thought
