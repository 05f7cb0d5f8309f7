r"""The marks between which models reason before they answer: templates, servers and models write them in many ways.

Every place that tells reasoning from an answer takes these patterns, so that a new mark is known to all of them. They
are sources of regular expressions, to be compiled with `re.IGNORECASE`; none of them can backtrack.

    BEGIN       begins a block
    END         ends a block, also one that began in the prompt: what stands before it is reasoning
    FINAL       begins the answer of a model that writes in channels
    BLOCK_END   ends a block whose beginning was seen: in channels, every message ends in the same mark
"""

from __future__ import annotations

from typing import Final

_NAMES: Final = "think", "thinking", "thought", "thoughts", "reasoning", "reflection", "scratchpad"
MARKS: Final = (
    *((f"<{name}>", f"</{name}>") for name in _NAMES),
    ("[THINK]", "[/THINK]"),
    ("◁think▷", "◁/think▷"),
    ("<|begin_of_thought|>", "<|end_of_thought|>"),
)
"""The beginning and the end of a block, in each form but channels: for tests of the places that must know them."""
CHANNELS: Final = "<|channel|>analysis<|message|>", "<|end|><|start|>assistant<|channel|>final<|message|>"
"""The same with channels, as gpt-oss writes them."""

_TAG: Final = "|".join(_NAMES)
_CHANNEL: Final = r"<\|channel\|>\s*+"
BEGIN: Final = (
    rf"<\s*+(?:{_TAG})\s*+>|\[THINK\]|◁think▷|<\|begin_of_thought\|>"
    rf"|{_CHANNEL}(?:analysis|commentary)\b[^<>\n]*+<\|message\|>"
)
END: Final = rf"<\s*+/\s*+(?:{_TAG})\s*+>|\[/THINK\]|◁/think▷|<\|end_of_thought\|>"
FINAL: Final = rf"{_CHANNEL}final\b[^<>\n]*+<\|message\|>"
BLOCK_END: Final = rf"{END}|<\|end\|>|{FINAL}"
