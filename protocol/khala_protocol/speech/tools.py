"""Tool calls as text: what models write that were trained to call tools, when nobody reads their calls for us.

    <invoke name="Move_Minimap"><parameter name="minimap">[20, 32]</parameter></invoke>      Anthropic
    <function=Move_Minimap><parameter=minimap>[20, 32]</parameter></function>                Qwen
    <function=Move_Minimap>{"minimap": [20, 32]}</function>                                  Llama
    [TOOL_CALLS]Move_Minimap[ARGS]{"minimap": [20, 32]}                                      Mistral
    functions.Move_Minimap:0<|tool_call_argument_begin|>{"minimap": [20, 32]}                Kimi
    <|channel|>commentary to=functions.Move_Minimap <|message|>{"minimap": [20, 32]}         gpt-oss
    - team: Stalker-1                                                                        YAML
      action: Move_Minimap
      minimap: [20, 32]

Those that are an object of JSON in tags are read by `khala_protocol.speech.objects`, and those that are a call of
Python by `khala_protocol.speech.calls`. Above it: `khala_protocol.speech.reader`.
"""

from __future__ import annotations

import re
from typing import Final

from khala_protocol.speech.marks import QUOTES
from khala_protocol.speech.objects import NAMES, TEAMS, ObjectCall, call_of, decode_at

BEGINS: Final = (
    r"<\s*+(?:\w+:)?invoke\s++name\b|<\s*+function\s*+=|\[TOOL_CALLS\]\s*+\w++\s*+\[|<\|tool_call_begin\|>"
    r"|<\|channel\|>\s*+commentary\s++to=|<\|tool.call.begin\|>"
)
"""Regular expression of what one of these forms begins with."""
_NAME = r"(?P<name>[A-Za-z]\w{0,80}+)"
_INVOKE = re.compile(rf"<\s*+(?:\w+:)?invoke\s++name\s*+=\s*+[\"']?{_NAME}[\"']?\s*+>", re.IGNORECASE)
_FUNCTION = re.compile(rf"<\s*+function\s*+=\s*+[\"']?{_NAME}[\"']?\s*+>", re.IGNORECASE)
_BEFORE_JSON = re.compile(
    rf"(?:\[TOOL_CALLS\]\s*+{_NAME}\s*+(?:\[CALL_ID\]\w*+)?\[ARGS\]"
    r"|(?:<\|tool_call_begin\|>)?\s*+functions\.(?P<of_kimi>[A-Za-z]\w{0,80}+):[0-9]++\s*+<\|tool_call_argument_begin\|>"
    r"|<\|channel\|>\s*+commentary\s++to=functions\.(?P<of_harmony>[A-Za-z]\w{0,80}+)[^<\n]*+(?:<\|constrain\|>\s*+\w++\s*+)?<\|message\|>"
    r"|<\|tool.call.begin\|>\s*+function\s*+<\|tool.sep\|>\s*+(?P<of_deepseek>[A-Za-z]\w{0,80}+)\s*+(?:```json)?)\s*+(?=\{)"
)
_PARAMETER = re.compile(
    r"\s*+<\s*+(?:\w+:)?parameter(?:\s++name)?\s*+=\s*+[\"']?(?P<key>\w{1,40}+)[\"']?[^<>]*+>(?P<value>[^<>]{0,400}+)"
    r"</\s*+(?:\w+:)?parameter\s*+>",
    re.IGNORECASE,
)
_END = re.compile(r"\s*+</\s*+(?:\w+:)?(?:invoke|function)\s*+>", re.IGNORECASE)
_YAML_LINE = re.compile(
    r"[ \t]*+(?:-[ \t]++)?[\"']?(?P<key>[A-Za-z_]\w{0,40}+)[\"']?[ \t]*+:[ \t]*+(?P<value>[^\n<>]{1,200}+)(?:\n|$)"
)
_YAML_OPEN = re.compile(r"[ \t]*+[\"']?(?P<key>[A-Za-z_]\w{0,40}+)[\"']?[ \t]*+:[ \t]*+\n")
_YAML_VALUE = re.compile(r"[ \t]*+-[ \t]++(?P<value>[^\n<>:]{1,60}+)(?:\n|$)")
_NESTED = frozenset({"args", "arguments", "parameters", "params", "input"})
"""Keys whose own keys below them are those of the call."""
_YAML_BEGIN = re.compile(rf"[ \t]*+-[ \t]++[\"']?(?:{'|'.join((*TEAMS, *NAMES))})[\"']?[ \t]*+:", re.IGNORECASE)
_YAML_ITEM = re.compile(r"[ \t]*+-[ \t]")
_OBJECT = re.compile(r"\s*+(?=\{)")
_MOST_KEYS = 8


def tool_at(text: str, raw: str, at: int) -> ObjectCall | None:
    """Return the call at this place, in one of the forms of the module; None if there is none.

    Args:
        text: the reply, as `khala_protocol.speech.marks.to_ascii` returns it.
        raw: the reply as it is: JSON has escapes of its own.
        at: the offset in both.
    """
    if opened := _INVOKE.match(text, at) or _FUNCTION.match(text, at):
        return _element(text, raw, opened)
    if named := _BEFORE_JSON.match(text, at):
        name = next(found for found in named.groupdict().values() if found)
        given = decode_at(raw, named.end())
        return given and call_of({"name": name, "arguments": given[0]}, given[1])
    return None


def item_at(text: str, at: int) -> ObjectCall | None:
    """Return the call in the item of a list of YAML that begins with this line."""
    if not _YAML_BEGIN.match(text, at):
        return None
    found: dict[str, str] = {}
    while len(found) < _MOST_KEYS and (line := _YAML_LINE.match(text, at) or _YAML_OPEN.match(text, at)):
        if found and (line["key"].lower() in found or _YAML_ITEM.match(text, at)):
            break
        at = line.end()
        if line.re is _YAML_LINE:
            found[line["key"].lower()] = line["value"].strip(QUOTES + " \t")
            continue
        values, at = _values_at(text, at)
        if values:
            found[line["key"].lower()] = f"[{', '.join(values)}]"
        elif line["key"].lower() not in _NESTED:
            return None
    key = next((key for key in NAMES if key in found), None)
    if key is None or "(" in found[key] or not ("_" in found[key] or len(found) > len(("team", "action"))):
        return None
    return call_of({"name": found.pop(key), "arguments": found}, at)


def _values_at(text: str, at: int) -> tuple[list[str], int]:
    """Return the values of a YAML list, one on each line from here on, and where it ends."""
    values: list[str] = []
    while len(values) < _MOST_KEYS and (item := _YAML_VALUE.match(text, at)):
        values.append(item["value"].strip(QUOTES + " \t"))
        at = item.end()
    return values, at


def _element(text: str, raw: str, opened: re.Match[str]) -> ObjectCall | None:
    given: object = None
    found: dict[str, str] = {}
    at = opened.end()
    while len(found) < _MOST_KEYS and (parameter := _PARAMETER.match(text, at)):
        found[parameter["key"].lower()] = parameter["value"].strip()
        at = parameter.end()
    if not found and (place := _OBJECT.match(text, at)) and (decoded := decode_at(raw, place.end())):
        given, at = decoded
    closed = _END.match(text, at)
    if not (closed or found or given is not None):
        return None
    return call_of(
        {"name": opened["name"], "arguments": found if given is None else given}, closed.end() if closed else at
    )
