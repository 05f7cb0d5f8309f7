"""The text language: one row for each rule of tolerance, one for each fault; and promises for every text."""

from __future__ import annotations

import re
import time
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khala_protocol import speech
from khala_protocol.messages import Call
from khala_protocol.speech import (
    Forget,
    ListenTo,
    MessageTo,
    Note,
    Revoke,
    ShownText,
    Speech,
    Standing,
    arguments,
    echoes,
    headings,
    parse,
    render,
)

REPLY = """Analysis: the Zealot 0x10ac is weak, so <Attack_Unit(0x10ac)> it.
Actions:
    Team Stalker-1:
        <Attack_Unit(0x1008c0001)>
        <Move_Screen([20, 9])>
    Team Zealot-1:
        <Hold_Position()>
Communications:
    <MessageTo(CombatGroup1, '''hold the ramp''')>
    <ListenTo(Channel-2)>
"""


def outline(speech: Speech) -> list[str]:
    """Return the content of a reply, one line each, in the order of the text; `?` marks mentions, `!` faults."""
    lines = [(call.start, f"{call.team}: {render(call)}" if call.team else render(call)) for call in speech.calls]
    lines += [(call.start, f"? {render(call)}") for call in speech.mentions]
    lines += [(message.start, f"to {message.recipient}: {message.text}") for message in speech.messages]
    lines += [(listen.start, f"hear {listen.channel}") for listen in speech.listens]
    lines += [(one.start, _kept(one)) for one in (*speech.notes, *speech.standing)]
    lines += [(fault.start, f"! {fault.text}") for fault in speech.faults]
    return [line for _, line in sorted(lines, key=lambda line: line[0])]


def _kept(one: Note | Forget | Standing | Revoke) -> str:
    match one:
        case Note():
            return f"note {one.text}"
        case Standing():
            return f"standing {render(one.call)}: {one.until}"
        case _:
            return f"{type(one).__name__.lower()} {one.number}"


def test_the_sample_of_the_documentation_is_read_in_full() -> None:
    assert outline(parse(REPLY)) == [
        "? <Attack_Unit(0x10ac)>",
        "Stalker-1: <Attack_Unit(0x1008c0001)>",
        "Stalker-1: <Move_Screen([20, 9])>",
        "Zealot-1: <Hold_Position()>",
        "to CombatGroup1: hold the ramp",
        "hear Channel-2",
    ]


ARGUMENTS = [
    ("A1", "0X001002C0001", ["0x1002c0001"]),
    ("A1", "0x0", ["0x0"]),
    ("A2", "'0x1'", ["0x1"]),
    ("A2", '"0x1"', ["0x1"]),
    ("A2", "`0x1`", ["0x1"]),
    ("A2", "“0x1”", ["0x1"]),
    ("A2", "**0x1**", ["0x1"]),
    ("A2", "'[3, 4]'", [(3, 4)]),
    ("A3", "tag=0x1", ["0x1"]),
    ("A3", "tag = '0x1'", ["0x1"]),
    ("A3", "target: 0x1", ["0x1"]),
    ("A3", "Stalker 0x1", ["0x1"]),
    ("A3", "screen=[3, 4]", [(3, 4)]),
    ("A3", "x=3, y=4", [(3, 4)]),
    ("A4", "[0x1]", ["0x1"]),
    ("A4", "('0x1')", ["0x1"]),
    ("A5", "[3, 4]", [(3, 4)]),
    ("A5", "[ 3 , 4 ]", [(3, 4)]),
    ("A5", "(3, 4)", [(3, 4)]),
    ("A5", "[3,4]", [(3, 4)]),
    ("A5", "[3 4]", [(3, 4)]),
    ("A5", "[3; 4]", [(3, 4)]),
    ("A5", "[3,\n4]", [(3, 4)]),
    ("A5", "{x: 3, y: 4}", [(3, 4)]),
    ("A5", '{"x": 3, "y": 4}', [(3, 4)]),
    ("A5", "[x=3, y=4]", [(3, 4)]),
    ("A5", "0x1, [3, 4]", ["0x1", (3, 4)]),
    ("A5", "[3, 4], 0x1", [(3, 4), "0x1"]),
    ("A5", "[3, 4], [5, 6]", [(3, 4), (5, 6)]),
    ("A6", "3, 4", [(3, 4)]),
    ("A6", "0x1, 3, 4", ["0x1", (3, 4)]),
    ("A6", "3", ["3"]),
    ("A6", "3, 4, 5", [(3, 4), "5"]),
    ("A6", "4295229441, 4295229442", ["4295229441", "4295229442"]),
    ("A7", "[-0.5, 1e1]", [(-0.5, 10)]),
    ("A7", "[.5, +2.]", [(0.5, 2)]),
    ("A7", "[100000, -7]", [(100000, -7)]),
    ("A8", "0x1,", ["0x1"]),
    ("A8", "0x1; ", ["0x1"]),
    ("A8", " , ", []),
    ("A6", "'3 4'", [(3, 4)]),
    ("A2", "#0x1", ["0x1"]),
    ("A9", "4295229441", ["4295229441"]),
    ("A9", "[1, 2, 3]", ["[1, 2, 3]"]),
    ("A9", "[1]", ["[1]"]),
    ("A9", "[1-2]", ["[1-2]"]),
    ("A9", "[nan, inf]", ["[nan, inf]"]),
    ("A9", "[1e999, 2]", ["[1e999, 2]"]),
    ("A9", "0xZZ", ["0xZZ"]),
    ("A9", "0x", ["0x"]),
    ("A9", "left flank", ["left flank"]),
    ("A9", "mode=fast", ["mode=fast"]),
    ("A9", "", []),
    ("A10", "0x1 (Zealot)", ["0x1"]),
    ("A10", "0x1 Zealot", ["0x1"]),
    ("A10", "0x1 - the weak one", ["0x1"]),
    ("A10", "0x1 /* weak */", ["0x1"]),
    ("A10", "0x1 at 3", ["0x1 at 3"]),
    ("A10", "enemy Zealot 0x1", ["0x1"]),
    ("A11", "y=4, x=3", [(3, 4)]),
    ("A11", "{y: 4, x: 3}", [(3, 4)]),
    ("A11", "x: 3; y: 4", [(3, 4)]),
    ("A11", "max: 3, y: 4", [(3, 4)]),
    ("A12", "[3, 4", [(3, 4)]),
    ("A12", "3, 4]", [(3, 4)]),
    ("A12", "[[3, 4]]", [(3, 4)]),
    ("A13", "0x1 0x2", ["0x1", "0x2"]),
    ("A13", "0x1 [3, 4]", ["0x1", (3, 4)]),
    ("A13", 'tag="0x1" screen="[3, 4]"', ["0x1", (3, 4)]),
]


def test_the_form_of_an_argument_says_what_it_is(subtests: pytest.Subtests) -> None:
    for rule, inside, wanted in ARGUMENTS:
        with subtests.test(rule, inside=inside):
            speech = parse(f"<Act({inside})>")
            assert [list(call.args) for call in speech.calls] == [wanted]
            assert not speech.faults


HEADINGS = [
    ("H1", "<Stop()>\nACTIONS:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H1", "<Stop()>\nactions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H1", "<Stop()>\nAction:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H1", "<MessageTo(A, 'x')>\nCOMMUNICATION:\n<MessageTo(A, 'y')>", ["to A: y"]),
    ("H1", "<MessageTo(A, 'x')>\nmessages:\n<MessageTo(A, 'y')>", ["to A: y"]),
    ("H2", "<Stop()>\n**Actions**:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H2", "<Stop()>\n**Actions:**\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H2", "<Stop()>\n__Actions__:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H2", "<Stop()>\n### 2. Actions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H2", "<Stop()>\n  - *Actions* :\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H2", "<Stop()>\n> _Actions_:\n> <Go()>", ["? <Stop()>", "<Go()>"]),
    ("H2", "<Stop()>\n`Actions`:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H2", "<Stop()>\n[Actions]:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H2", "<Stop()>\n🎯 Actions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H2", '<Stop()>\n"Actions": ["<Go()>"]', ["? <Stop()>", "<Go()>"]),
    ("H3", "<Stop()>\n### Actions\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H3", "<Stop()>\nActions\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H3", "<Stop()>\r\n**Actions**\r\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H3", "<Stop()>\nActions speak louder than words\n<Go()>", ["<Stop()>", "<Go()>"]),
    ("H4", "<Stop()>\nFinal Actions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H4", "<Stop()>\nAnalysis and Actions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H4", "<Stop()>\nActions (at most 3):\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H4", "<Stop()>\nAction 1: <Go()>\nAction 2: <Hold()>", ["? <Stop()>", "<Go()>", "<Hold()>"]),
    ("H4", "<Stop()>\nActions for Team Stalker-1:\n<Go()>", ["? <Stop()>", "Stalker-1: <Go()>"]),
    ("H5", "<Stop()>\n<Actions>\n<Go()>\n</Actions>", ["? <Stop()>", "<Go()>"]),
    ("H6", "Analysis: weak, <Stop()>? No. Actions: <Go()>", ["? <Stop()>", "<Go()>"]),
    ("H6", "Actions: Team A: <Stop()> Team B-1: <Go()>", ["A: <Stop()>", "B-1: <Go()>"]),
    ("H6", "Actions: A-1: <Stop()>; B-1: <Go()>", ["A-1: <Stop()>", "B-1: <Go()>"]),
    ("H6", "Actions:\n<Stop()> after this analysis\n<Stop()> analysis\n<Go()>", ["<Stop()>", "<Stop()>", "<Go()>"]),
    ("H7", "Team Stalker-1:\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H7", "team stalker-1 :\n<Go()>", ["stalker-1: <Go()>"]),
    ("H7", "TEAM STALKER-1:\n<Go()>", ["STALKER-1: <Go()>"]),
    ("H7", "**Team Stalker-1**:\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H7", "**Team Stalker-1:**\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H7", "_Team Stalker-1_:\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H7", "- Team `Stalker-1`: <Go()>", ["Stalker-1: <Go()>"]),
    ("H7", '1) Team "Stalker-1":\n<Go()>', ["Stalker-1: <Go()>"]),
    ("H7", "Team: Stalker-1\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H7", "Team Stalker 1:\n<Go()>", ["Stalker 1: <Go()>"]),
    ("H7", "Team Stalker-1 actions:\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H7", "Team Stalker-1: kite them\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H7", "Our team attacks now\n<Go()>", ["<Go()>"]),
    ("H7", "Team Stalker-1 is hurt\n<Go()>", ["<Go()>"]),
    ("H8", "#### Team Stalker-1\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H8", "Team Stalker-1 -> <Go()>", ["Stalker-1: <Go()>"]),
    ("H9", "Stalker-1:\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H9", "- **Stalker-1**: <Go()>", ["Stalker-1: <Go()>"]),
    ("H9", "Protoss_Units:\n<Go()>", ["Protoss_Units: <Go()>"]),
    ("H9", "Zealots:\n<Go()>", ["Zealots: <Go()>"]),
    ("H10", "Team Stalker-1 (2 units):\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H10", "Stalker-1 (all): <Go()>", ["Stalker-1: <Go()>"]),
    ("H11", "<Team Stalker-1>\n<Go()>\n</Team>", ["Stalker-1: <Go()>"]),
    ("H12", "Team A:\n<Stop()>\nBoth teams:\n<Go()>", ["A: <Stop()>", "Both teams: <Go()>"]),
    ("H12", "Team A:\n<Stop()>\nTeam B, Team C:\n<Go()>", ["A: <Stop()>", "B, Team C: <Go()>"]),
    ("H12", "Team A:\n<Stop()>\nTeams 'B' and 'C':\n<Go()>", ["A: <Stop()>", "B' and 'C: <Go()>"]),
    ("H12", "A-1:\n<Stop()>\nB-1, C-1:\n<Go()>", ["A-1: <Stop()>", "B-1, C-1: <Go()>"]),
    ("H12", "Team A:\n<Stop()>\nRetreat and heal:\n<Go()>", ["A: <Stop()>", "A: <Go()>"]),
    ("H13", "Team A:\n<Stop()>\nTeam:\n<Go()>", ["A: <Stop()>", "<Go()>"]),
    ("H14", "Team A:\nReasoning:\n<Go()>\nThen: <Stop()>", ["A: <Go()>", "A: <Stop()>"]),
    ("H14", "Team A:\n<Go()> and: <Stop()>", ["A: <Go()>", "A: <Stop()>"]),
    ("H15", "Stalker-1 → <Go()>", ["Stalker-1: <Go()>"]),
    ("H15", "Stalker-1 <Go()>", ["Stalker-1: <Go()>"]),
    ("H15", "| Team | Action |\n|---|---|\n| Stalker-1 | <Go()> |", ["Stalker-1: <Go()>"]),
    ("H15", "use <Go()>", ["<Go()>"]),
    ("H16", "Stalker-1 team:\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H16", "For Team Stalker-1:\n<Go()>", ["Stalker-1: <Go()>"]),
    ("H16", "Team A:\n<Stop()>\nOur team:\n<Go()>", ["A: <Stop()>", "A: <Go()>"]),
]

HEADINGS += [
    ("H11", '<team name="A-1">\n<Go()>\n</team>', ["A-1: <Go()>"]),
    ("H11", "<A-1>\n<Go()>\n</A-1>", ["A-1: <Go()>"]),
    ("H15", "- A-1\n  - <Go()>", ["A-1: <Go()>"]),
    ("H15", "| A-1 | weak | <Go()> |", ["A-1: <Go()>"]),
    ("H4", "Team A:\nAction 1: <Stop()>\nAction 2: <Go()>", ["A: <Stop()>", "A: <Go()>"]),
    ("H17", "<Stop()>\nAktionen:\nGruppe A:\n<Go()>", ["? <Stop()>", "A: <Go()>"]),
    ("H17", "<Stop()>\n动作：\n小队 A：\n<Go()>", ["? <Stop()>", "A: <Go()>"]),
    ("H17", "<Stop()>\n动作/Actions:\nA-1 队伍：\n<Go()>", ["? <Stop()>", "A-1: <Go()>"]),
    ("H17", "<Stop()>\nДействия:\nКоманда A:\n<Go()>", ["? <Stop()>", "A: <Go()>"]),
    ("H18", "Valid actions:\n<Stop()>\nActions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H18", "Actions:\n<Go()>\nAlternative actions:\n<Stop()>", ["<Go()>", "? <Stop()>"]),
    ("H18", "Actions:\n<Stop()>\nFinal actions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H18", "Actions:\nTeam A:\n<Stop()>\nTeam B:\n<Hold()>\nRevised actions for A:\n<Go()>",
     ["? <Stop()>", "B: <Hold()>", "A: <Go()>"]),
    ("H18", "Possible actions:\n<Go()>", ["<Go()>"]),
    ("H19", "Actions:\n<Go()>\nExplanation: <Stop()> is worse", ["<Go()>", "? <Stop()>"]),
    ("H19", "Actions:\n<Go()>\nSummary: now <Stop()>\n<Hold()>", ["<Go()>", "? <Stop()>", "<Hold()>"]),
    ("H19", "Actions:\n<Go()>\n## Notes\n<Stop()> next", ["<Go()>", "? <Stop()>"]),
    ("H19", "Explanation: weak\nActions:\n<Go()>", ["<Go()>"]),
    ("H20", "Team A should <Go()>", ["A: <Go()>"]),
    ("H20", "A-1 will now <Stop()>. B-1 must <Go()>", ["A-1: <Stop()>", "B-1: <Go()>"]),
    ("H15", "### A-1 — kite\n<Go()>", ["A-1: <Go()>"]),
    ("H6", '{"analysis":"<Stop()>","actions":{"A-1":["<Go()>"]}}', ["? <Stop()>", "A-1: <Go()>"]),
    ("H6", "Team A: <Stop()>, and Team B: <Go()>", ["A: <Stop()>", "B: <Go()>"]),
    ("H21", '{"team": "A-1", "do": "<Go()>"}', ["A-1: <Go()>"]),
    ("H22", "Your last errors\n    A-1 <Stop()>\n\nActions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("H22", "What will do for team A-1:\n    <Stop()>\nNot possible now:\n<Stop()>", ["? <Stop()>", "? <Stop()>"]),
    ("H23", "Team A-1, unit 0x2:\n<Go()>", ["A-1, unit 0x2: <Go()>"]),
]  # fmt: skip
SHOWN = ShownText("- <Attack_Unit(tag)>: Attack the enemy.\n- <Stop()>: Stop moving and firing.")
INVOKE = '<function_calls><invoke name="Go_To"><parameter name="minimap">[3, 4]</parameter></invoke></function_calls>'
HARMONY = (
    "<|channel|>analysis<|message|>so <Stop()><|end|><|start|>assistant<|channel|>commentary to=functions.Go_To "
    '<|constrain|>json<|message|>{"team": "A", "minimap": [3, 4]}<|call|>'
)
YAML_READ = ["A: <Go_To([3, 4])>", "B: <Hold_Position()>"]
RULES = [
    ("S1", "<Stop()>", ["<Stop()>"]),
    ("S1", "I will do this.\n<Stop()>\n<Go()>", ["<Stop()>", "<Go()>"]),
    ("S1", "<MessageTo(A, 'go')>", ["to A: go"]),
    ("S1", "Analysis: I think <Stop()> is best", ["<Stop()>"]),
    ("S2", "first <Stop()>, then <Go()>!", ["<Stop()>", "<Go()>"]),
    ("S2", "<Stop()><Go()>", ["<Stop()>", "<Go()>"]),
    ("S2", "<Stop()> <MessageTo(A, 'x')> <Go()>", ["<Stop()>", "to A: x", "<Go()>"]),
    ("S2", "<Stop()>  # keep team A: alive", ["<Stop()>"]),
    ("S3", "< Attack_Unit ( 0x1 ) >", ["<Attack_Unit(0x1)>"]),
    ("S3", "<Move_Screen(\n    [3,\n 4]\n)\n>", ["<Move_Screen([3, 4])>"]),
    ("S4", "<Hold_Position>", ["<Hold_Position()>"]),
    ("S4", "<Stop>", ["<Stop()>"]),
    ("S4", "<Hold_Position/>", ["<Hold_Position()>"]),
    ("S4", "< Hold_Position />", ["<Hold_Position()>"]),
    ("S4", "<Hold_Position></Hold_Position>", ["<Hold_Position()>"]),
    ("S5", "- <Stop()>\n* <Go()>\n3. <Hold()>", ["<Stop()>", "<Go()>", "<Hold()>"]),
    ("S5", "`<Stop()>`, **<Go()>**", ["<Stop()>", "<Go()>"]),
    ("S5", "```python\n<Stop()>\n```", ["<Stop()>"]),
    ("S5", "> <Stop()>\n> <Go()>", ["<Stop()>", "<Go()>"]),
    ("S5", r"\<Attack\_Unit\(0x1\)\>", ["<Attack_Unit(0x1)>"]),
    ("S6", "＜Stop（）＞", ["<Stop()>"]),
    ("S6", "<Move_Screen（【３，４】）>", ["<Move_Screen([3, 4])>"]),
    ("S6", "Team A：\n<Stop()>", ["A: <Stop()>"]),
    ("S6", "<MessageTo（A，“走”）>", ["to A: 走"]),
    ("S7", "<b>x</b><br><br/><DIV><h1>", []),
    ("S7", "<answer>\n<Stop()>\n</answer>", ["<Stop()>"]),
    ("S7", "<Answer>\n<Stop()>\n</Answer>", ["<Stop()>"]),
    ("S7", '<tool_call>{"name": 1}</tool_call>', []),
    ("S7", "<a href='x(1)'>x</a> <!-- no --> <|end|> <0x1008c0001>", []),
    ("S7", "health < 50 and > 20, 3<4, a <b, a < b(c), x <= y, <- <3 <", []),
    ("S8", "<think><Stop()>\nActions: <Bad_Call(></think><Go()>", ["<Go()>"]),
    ("S8", "<Thinking> <Stop()> </THINKING> <Go()>", ["<Go()>"]),
    ("S8", "[THINK]<Stop()>[/THINK]<Go()>", ["<Go()>"]),
    ("S8", "<think>a</think><Go()><think><Stop()></think>", ["<Go()>"]),
    ("S9", "Actions:\nTeam A:\n<Stop()> </think> <Go()>", ["<Go()>"]),
    ("S10", "Analysis: <Stop()>?\nActions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("S10", "I may <Stop()>.\nActions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("S10", "Actions:\n<Go()>\nAnalysis: <Stop()> is worse", ["<Go()>", "? <Stop()>"]),
    ("S10", "Analysis: Attack_Unit(0x1) or <Attack_Unit 0x1>?\nActions:\n<Go()>", ["? <Attack_Unit(0x1)>", "<Go()>"]),
    ("S10", "Analysis: <Stop()>\nActions:", ["? <Stop()>"]),
    ("S11", "Analysis: <MessageTo(A, 'x')>?\nCommunications:\n<MessageTo(A, 'y')>", ["to A: y"]),
    ("S11", "Analysis: <MessageTo(A, 'x')>\nActions:\n<Go()>", ["to A: x", "<Go()>"]),
    ("S12", "Actions:\n<Stop()>\nActions:\n<Go()>", ["<Stop()>", "<Go()>"]),
    ("S12", "Communications:\n<MessageTo(A, 'x')>\nActions:\n<Go()>", ["to A: x", "<Go()>"]),
    ("S12", "Actions:\n<MessageTo(A, 'x')>\n<Go()>", ["to A: x", "<Go()>"]),
    ("S12", "Communications:\n<MessageTo(A, 'x')>\n<Go()>", ["to A: x", "<Go()>"]),
    ("S12", "<Go()>\nCommunications:\n<MessageTo(A, 'x')>", ["<Go()>", "to A: x"]),
    ("S13", "Team A:\n<Stop()>\nsome words\n<Go()>", ["A: <Stop()>", "A: <Go()>"]),
    ("S13", "Actions:\nTeam A:\n<Stop()>\nActions:\n<Go()>", ["A: <Stop()>", "<Go()>"]),
    ("S13", "Analysis:\nTeam A: is hurt\nActions:\n<Go()>", ["<Go()>"]),
    ("S14", "Team A:\nAnalysis: x\nActions: <Stop()>\nTeam B:\nActions: <Go()>", ["A: <Stop()>", "B: <Go()>"]),
    ("S14", "**Team A**\n\n**Actions:** <Stop()>", ["A: <Stop()>"]),
    ("S15", "<MessageTo(A, '''it's \"on\"''')>", ["to A: it's \"on\""]),
    ("S15", '<MessageTo(A, """go""")>', ["to A: go"]),
    ("S15", "<MessageTo(A, ```go```)>", ["to A: go"]),
    ("S15", "<MessageTo(A, 'go')>", ["to A: go"]),
    ("S15", '<MessageTo(A, "go")>', ["to A: go"]),
    ("S15", "<MessageTo(A, `go`)>", ["to A: go"]),
    ("S15", "<MessageTo(A, “go”)>", ["to A: go"]),
    ("S15", "<MessageTo(A, ‘go’)>", ["to A: go"]),
    ("S15", "<MessageTo(A, „go“)>", ["to A: go"]),
    ("S15", "<MessageTo(A, «go»)>", ["to A: go"]),
    ("S15", "<MessageTo(A, »go«)>", ["to A: go"]),
    ("S15", "<MessageTo(A, ‹go›)>", ["to A: go"]),
    ("S15", "<MessageTo(A, 「go」)>", ["to A: go"]),
    ("S15", "<MessageTo(A, “go\")>", ["to A: go"]),
    ("S15", "<MessageTo(A, ''go'')>", ["to A: go"]),
    ("S16", "<MessageTo(A, '''one\n  two\nActions:\nTeam B:''')>", ["to A: one\n  two\nActions:\nTeam B:"]),
    ("S16", "<MessageTo(A, '''a) (b) > 3 [x] {y} <b>''')>", ["to A: a) (b) > 3 [x] {y} <b>"]),
    ("S16", "<MessageTo(A, '''use <Attack_Unit(0x1)> now''')>", ["to A: use <Attack_Unit(0x1)> now"]),
    ("S16", "<MessageTo(A, '''tell <MessageTo(B, \"x\")> so''')>", ["to A: tell <MessageTo(B, \"x\")> so"]),
    ("S16", "<MessageTo(A, 'don't stop, I'm (here) now')>", ["to A: don't stop, I'm (here) now"]),
    ("S16", "<MessageTo(A, '''<think>''')>\n<Go()>", ["to A: <think>", "<Go()>"]),
    ("S17", "<MessageTo(A, hold the ramp)>", ["to A: hold the ramp"]),
    ("S17", "<MessageTo(A, hold (now) > 3)> <Go()>", ["to A: hold (now) > 3", "<Go()>"]),
    ("S17", "<MessageTo(A, use <Attack_Unit(0x1)> now)>", ["to A: use <Attack_Unit(0x1)> now"]),
    ("S17", "<MessageTo(A, '''hold)>\n<MessageTo(B, '''go''')>", ["to A: hold", "to B: go"]),
    ("S17", "<MessageTo(A, '''hold'')>\n<Go()>", ["to A: hold", "<Go()>"]),
    ("S17", "<MessageTo(A, hold''')>", ["to A: hold"]),
    ("S18", "<MessageTo( A , 'go' )>", ["to A: go"]),
    ("S18", "<MessageTo('A', 'go')>", ["to A: go"]),
    ("S18", '<MessageTo(to="A", text="go")>', ["to A: go"]),
    ("S18", "<MessageTo(recipient: A, message: 'go')>", ["to A: go"]),
    ("S18", "<MessageTo([Combat Group 1], 'go')>", ["to Combat Group 1: go"]),
    ("S18", "<MessageTo(A '''go''')>", ["to A: go"]),
    ("S18", "<MessageTo(\"A\" \"go\")>", ["to A: go"]),
    ("S18", "<MessageTo(Channel-1: 'go')>", ["to Channel-1: go"]),
    ("S19", "<messageto(A, 'go')> <Message_To(A, 'on')> <LISTENTO(C)>", ["to A: go", "to A: on", "hear C"]),
    ("S20", "<ListenTo(Channel-1, 'Channel-2')>", ["hear Channel-1", "hear Channel-2"]),
    ("S7", "List<Unit>, Map<Tag, Unit>", []),
    ("S21", "<Attack Unit(0x1)>", ["<Attack_Unit(0x1)>"]),
    ("S5", "<**Stop**()>", ["<Stop()>"]),
    ("S21", "health < Max Health (100) and > 3", []),
    ("S22", "<Attack_Unit(0x1>", ["<Attack_Unit(0x1)>"]),
    ("S22", "<Stop(>", ["<Stop()>"]),
    ("S22", "<Move_Screen([20, 9)>", ["<Move_Screen([20, 9])>"]),
    ("S22", "<Move_Screen([20, 9>", ["<Move_Screen([20, 9])>"]),
    ("S22", "<Move_Screen(20, 9])>", ["<Move_Screen([20, 9])>"]),
    ("S22", "<Attack_Unit(0x1))>", ["<Attack_Unit(0x1)>"]),
    ("S22", "<Stop()\n<Go()", ["<Stop()>", "<Go()>"]),
    ("S22", "<Stop() <Go()>", ["<Stop()>", "<Go()>"]),
    ("S23", "- Attack_Unit(0x1)", ["<Attack_Unit(0x1)>"]),
    ("S23", "Attack_Unit(0x1)  # weak\nStop();", ["<Attack_Unit(0x1)>", "<Stop()>"]),
    ("S23", "Team A: Stop()", ["A: <Stop()>"]),
    ("S23", "A-1.Stop()", ["A-1: <Stop()>"]),
    ("S23", '{"orders": ["Attack_Unit(0x1)", "Stop()"]}', ["<Attack_Unit(0x1)>", "<Stop()>"]),
    ("S23", "Analysis:\nStop()\nActions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("S24", "<!-- <Stop()> --><Go()>", ["<Go()>"]),
    ("S24", "~~<Stop()>~~ <Go()>", ["? <Stop()>", "<Go()>"]),
    ("S25", "do not <Stop()>, <Go()> instead", ["? <Stop()>", "<Go()>"]),
    ("S25", "<Go()> instead of `<Stop()>`", ["<Go()>", "? <Stop()>"]),
    ("S25", "nicht <Stop()>, не <Hold()>, 不要<Wait()>", ["? <Stop()>", "? <Hold()>", "? <Wait()>"]),
    ("S25", "They do not see us: <Go()>\nI know\n<Stop()>", ["<Go()>", "<Stop()>"]),
    ("S25", "Never: <Stop()>\nnot yet: <Hold()>\nRetreat? No: <Go()>", ["? <Stop()>", "? <Hold()>", "<Go()>"]),
    ("S25", "Do not <MessageTo(A, 'x')>", []),
    ("S26", "<Go()>\nUser: next\n<Stop()>", ["<Go()>"]),
    ("S26", "<Go()><|im_end|><|im_start|>user\n<Stop()>", ["<Go()>"]),
    ("S26", "User: go\n<Go()>", ["<Go()>"]),
    ("S27", "Actions:\n<Go()>\nActions:\n<Go()>", ["<Go()>", "? <Go()>"]),
    ("S27", "Actions:\n<Go()>\n<Go()>", ["<Go()>", "<Go()>"]),
    ("S27", "Actions:\nA-1:\n<Go()>\nActions:\nB-1:\n<Go()>", ["A-1: <Go()>", "B-1: <Go()>"]),
    ("S28", '{"action": "Attack_Unit", "args": ["0x1"]}', ["<Attack_Unit(0x1)>"]),
    ("S28", '[{"team": "A", "name": "Move_Screen", "arguments": {"screen": [3, 4]}}]', ["A: <Move_Screen([3, 4])>"]),
    ("S28", '{"function": {"name": "Move_Screen", "arguments": {"x": 3, "y": 4}}}', ["<Move_Screen([3, 4])>"]),
    ("S28", '{"name": "Go", "arguments": {"team": "A"}}', ["A: <Go()>"]),
    ("S28", '{"to": "A", "text": "go"} {"to": 3}', ["to A: go"]),
    ("S28", '{"name": "Zealot", "health": 20} {"name": 3} {"action": "', []),
    ("S29", "<Attack_Unit>0x1</Attack_Unit>", ["<Attack_Unit(0x1)>"]),
    ("S29", '<Attack_Unit tag="0x1"/>', ["<Attack_Unit(0x1)>"]),
    ("S30", "<Attack_Unit 0x1>", ["<Attack_Unit(0x1)>"]),
    ("S30", "<Attack_Unit: 0x1>", ["<Attack_Unit(0x1)>"]),
    ("S30", "<Attack_Unit[0x1]>", ["<Attack_Unit(0x1)>"]),
    ("S31", "&lt;Stop()&gt;", ["<Stop()>"]),
    ("S31", "&lt;MessageTo(A, &quot;it&#39;s &lt;on&gt;&quot;)&gt;", ["to A: it's <on>"]),
    ("S31", r'"Actions:\n<MessageTo(A, \"go\nnow\")>"', ["to A: go\nnow"]),
    ("S31", "<Attack_Unit(<0x1>)>", ["<Attack_Unit(0x1)>"]),
    ("S32", "◁think▷<Stop()>◁/think▷<Go()>", ["<Go()>"]),
    ("S32", "<|channel|>analysis<|message|><Stop()><|channel|>final<|message|>Actions: <Go()>", ["<Go()>"]),
    ("S33", "MessageTo(A, 'go (now)')", ["to A: go (now)"]),
    ("S33", "<MessageTo(A, '''go'''>\n<MessageTo(B, '''go''')", ["to A: go", "to B: go"]),
    ("S33", "<MessageTo>A, 'go'</MessageTo>", ["to A: go"]),
    ("S33", '<MessageTo name="A" text="go"/>', ["to A: go"]),
    ("S33", "<MessageTo(A, ‘’‘go’’’)>", ["to A: go"]),
    ("S34", "<Note('''hold (now) -> x''')>", ["note hold (now) -> x"]),
    ("S34", "Analysis: <Note(go home)>\nActions:\n- Note('stay')", ["note go home", "note stay"]),
    ("S34", "<Note>two Roaches</Note>", ["note two Roaches"]),
    ("S34", '{"action": "Note", "args": ["two Roaches"]}', ["note two Roaches"]),
    ("S34", "Note: two Roaches", []),
    ("S34", "<Forget(2)> <Revoke(1, 3)>\nforget(4)", ["forget 2", "revoke 1", "revoke 3", "forget 4"]),
    ("S35", "<Standing(Train_Probe(), until 22 Probe)>", ["standing <Train_Probe()>: 22 Probe"]),
    ("S35", "Team A:\n- Standing(<Go([4, 6])>)", ["standing <Go([4, 6])>: "]),
    ("S35", "<Standing('Stop', \"4:30\")>", ["standing <Stop()>: 4:30"]),
    ("S35", '{"action": "Standing", "args": ["Stop()", "until attacked"]}', ["standing <Stop()>: attacked"]),
    ("S35", "Analysis: <Standing(Stop())>?\nActions:\n<Go()>", ["? <Stop()>", "<Go()>"]),
    ("S36", "<MessageTo(A, 'go')> <MessageTo(B, 'go')>\n<MessageTo(A, \"go\")>", ["to A: go", "to B: go"]),
    ("S37", INVOKE, ["<Go_To([3, 4])>"]),
    ("S37", '<function_calls>\n<invoke name="Stop">\n<parameter name="team">A</parameter>\n</invoke>', ["A: <Stop()>"]),
    ("S37", "<function=Go_To><parameter=minimap>[3, 4]</parameter></function>", ["<Go_To([3, 4])>"]),
    ("S37", '<function=Go_To>{"minimap": [3, 4]}</function>', ["<Go_To([3, 4])>"]),
    ("S37", '[TOOL_CALLS]Go_To[ARGS]{"team": "A", "minimap": [3, 4]}', ["A: <Go_To([3, 4])>"]),
    ("S37", 'functions.Go_To:0<|tool_call_argument_begin|>{"minimap": [3, 4]}', []),
    ("S37", '<|tool_call_begin|>functions.Go_To:0<|tool_call_argument_begin|>{"tag": "0x1"}', ["<Go_To(0x1)>"]),
    ("S37", "<｜tool▁call▁begin｜>function<｜tool▁sep｜>Go_To\n```json\n{\"tag\": \"0x1\"}\n```", ["<Go_To(0x1)>"]),
    ("S37", HARMONY, ["A: <Go_To([3, 4])>"]),
    ("S37", '{"tool_calls": [{"function": {"name": "Go", "arguments": "{\\"team\\": \\"A\\"}"}}]}', ["A: <Go()>"]),
    ("S37", "<|python_tag|>Go_To.call(minimap=[3, 4])", ["<Go_To([3, 4])>"]),
    ("S37", "```tool_code\nprint(default_api.Go_To(team='A', minimap=[3, 4]))\n```", ["A: <Go_To([3, 4])>"]),
    ("S38", "- team: A\n  action: Go_To\n  minimap: [3, 4]\n- team: B\n  action: Hold_Position", YAML_READ),
    ("S38", "- action: Go_To\n  team: A\n  args:\n    minimap:\n      - 3\n      - 4\n", ["A: <Go_To([3, 4])>"]),
    ("S38", "- action: gather at the ramp\n- target: 0x1", []),
    ("S39", 'go_to(team="A-1", minimap=(3, 4))', ["A-1: <go_to([3, 4])>"]),
    ("S39", 'Go_To(minimap=(3, 4), team="A-1")', ["A-1: <Go_To([3, 4])>"]),
    ("S39", "**Final Answer:** `Go_To([3, 4])` for A-1", ["A-1: <Go_To([3, 4])>"]),
    ("S39", "We could use Go_To([3, 4]) for A-1 later", []),
    ("S40", "Actions:\n<Go()>\n\nGame\n    Time: 1:20\nActions:\n<Stop()>", ["<Go()>"]),
    ("S40", "Game\n    Time: 1:20\nActions:\n<Stop()>", ["<Stop()>"]),
    ("S41", '{"analysis": "<Stop()>? Actions: <Stop()>", "orders": [{"team": "A", "action": "Go"}]}', ["A: <Go()>"]),
    ("S41", '<think>x</think>```json\n{"orders": [{"action": "Select_Unit_Go", "tag": "0x2", "unit": "0x1"}]}\n```',
     ["<Select_Unit_Go(0x1, 0x2)>"]),
    ("S41", '{"orders": [], "messages": [{"to": "A", "text": "<Stop()>"}]}', ["to A: <Stop()>"]),
    ("S41", '{"orders": [{"action": "Go_To", "screen": {"y": 3, "x": 4}}], "why": "no"}', ["<Go_To([4, 3])>"]),
    ("S42", '{"orders": [{"team": "A", "action": "Train", "until": "22 Probe"}]}', ["standing <Train()>: 22 Probe"]),
    ("S42", '{"name": "Train_X", "arguments": {"team": "A", "until": "revoked"}}', ["standing <Train_X()>: "]),
    ("E1", "Actions:\n- <Stop()>: Stop moving and firing.\n- <Stop()>: they are strong", ["? <Stop()>", "<Stop()>"]),
    ("E2", "accepted: A-1 <Stop()>\nrejected: <Go()>: no", ["? <Stop()>", "? <Go()>"]),
    ("E2", "(write it like <Stop()>)", ["? <Stop()>"]),
    ("E2", "**Accepted**: <Stop()>\n**Rejected:** A-1: <Go()>", ["? <Stop()>", "? <Go()>"]),
    ("E2", "write it like **<Stop()>**\ndid you mean <Go()>?", ["? <Stop()>", "? <Go()>"]),
    ("E3", "A: <Attack_Unit(tag)>, <Stop()>\n\n<Go()>", ["? <Attack_Unit(tag)>", "? <Stop()>", "A: <Go()>"]),
    ("E3", "Actions:\n<Attack_Unit(tag)>", ["<Attack_Unit(tag)>"]),
    ("E4", "Valid actions\n    Team A: <Stop()>\n\nTeam A: <Go()>", ["? <Stop()>", "A: <Go()>"]),
    ("E4", "Valid actions:\nTeam A: <Attack_Unit(0x1)>", ["A: <Attack_Unit(0x1)>"]),
    ("E6", "Actions:\n- <Attack_Unit(tag)>: Attack the enemy.\n- <Stop()>", ["? <Attack_Unit(tag)>", "? <Stop()>"]),
    ("E5", "Your last actions\n    A-1 <Attack_Unit(0x1)>\n\n<Go()>", ["? <Attack_Unit(0x1)>", "A-1: <Go()>"]),
]  # fmt: skip


def test_a_reply_is_read_as_it_was_meant(subtests: pytest.Subtests) -> None:
    for rule, text, lines in HEADINGS + RULES:
        with subtests.test(rule, text=text):
            assert outline(parse(text, SHOWN)) == lines


def test_every_rule_of_the_documentation_has_a_row_and_every_row_a_rule() -> None:
    documented = [
        rule
        for module in (speech, headings, arguments, echoes)
        for rule in re.findall(r"^\| ([SHAE]\d+) \|", module.__doc__ or "", re.MULTILINE)
    ]
    assert len(documented) == len(set(documented))
    assert {row[0] for row in [*ARGUMENTS, *HEADINGS, *RULES]} == set(documented)


FAULTS = [
    ("<Attack_Unit(0x1", "<Attack_Unit(0x1", "the call is not closed: end it with )> as in <Attack_Unit(...)>"),
    (
        "<Attack_Unit(0x1\n<Go()>",
        "<Attack_Unit(0x1",
        "the call is not closed: end it with )> as in <Attack_Unit(...)>",
    ),
    (
        "<Attack_Unit(0x1\n>",
        "<Attack_Unit(0x1",
        "a bracket is not closed before '>': write <Attack_Unit(...)> and close every bracket",
    ),
    (
        "<Move_Screen([20, 9) now]>",
        "<Move_Screen([20, 9) now]>",
        "a bracket is not closed before ')': write <Move_Screen(...)> and close every bracket",
    ),
    ("<Stop() now", "<Stop() now", "a '>' is missing behind the ')': write <Stop(...)>"),
    (
        "<Act(0x1,,0x2)>",
        "<Act(0x1,,0x2)>",
        "an argument between two commas is empty: fill it in or leave the comma out",
    ),
    (
        "<Attack_Unit the Zealot>",
        "<Attack_Unit the Zealot>",
        "the name of a call is one word, its arguments stand in parentheses: write <Attack_Unit(...)>",
    ),
    ("Attack_Unit(0x1) is best", "Attack_Unit(0x1)", "a call stands in angle brackets: write <Attack_Unit(...)>"),
    ("Attack_Unit 0x1", "Attack_Unit 0x1", "a call stands in angle brackets: write <Attack_Unit(...)>"),
    ("| Attack_Unit | 0x1 |", "Attack_Unit | 0x1", "a call stands in angle brackets: write <Attack_Unit(...)>"),
    ("MessageTo(A, 'go", "MessageTo(", "the message to A is not closed: write <MessageTo(Name, '''text''')>"),
    (
        "<MessageTo(A)>",
        "<MessageTo(A)>",
        "a message needs a recipient and a text: write <MessageTo(Name, '''text''')>",
    ),
    (
        "<MessageTo('''go''')>",
        "<MessageTo('''go''')>",
        "a message needs a recipient and a text: write <MessageTo(Name, '''text''')>",
    ),
    ("<MessageTo>", "<MessageTo>", "a message needs a recipient and a text: write <MessageTo(Name, '''text''')>"),
    (
        "<MessageTo(A, '''''')>",
        "<MessageTo(A, '''''')>",
        "the message has no text: write <MessageTo(Name, '''text''')>",
    ),
    (
        "<MessageTo(A, '''hold the",
        "<MessageTo(A, '''hold the",
        "the message to A is not closed: end it with ''')>",
    ),
    ("<ListenTo()>", "<ListenTo()>", "a channel is missing: write <ListenTo(Name)>"),
    (
        "<think>hm <Stop()>",
        "<think>",
        "the reasoning block is not closed, so nothing behind it was carried out: end it with </think>",
    ),
]


@pytest.mark.parametrize(("text", "words", "message"), FAULTS)
def test_what_looks_like_a_call_and_is_none_is_reported_with_its_place(text: str, words: str, message: str) -> None:
    prefix = "Actions:\n  Team A:\n    "
    speech = parse(prefix + text)
    assert [(fault.reason, fault.text, fault.message) for fault in speech.faults] == [("malformed", words, message)]
    fault = speech.faults[0]
    assert (prefix + text)[fault.start :].startswith(fault.text)
    assert fault.team == "A"


@pytest.mark.parametrize("bad", [text for text, _, _ in FAULTS if not text.startswith("<think>")])
def test_a_fault_costs_nothing_but_itself(bad: str) -> None:
    text = f"Actions:\nTeam A:\n<Stop()>\n{bad}\nTeam B:\n<Go()>\nCommunications:\n<MessageTo(C, '''hi''')>"
    assert outline(parse(text))[0] == "A: <Stop()>"
    assert outline(parse(text))[-2:] == ["B: <Go()>", "to C: hi"]


def test_a_fault_repeats_only_the_beginning_of_its_words() -> None:
    fault = parse("<Attack_Unit(" + "x" * 5000).faults[0]
    assert len(fault.text) == 120


# --- promises for every text -------------------------------------------------------------------------

FRAGMENTS = st.sampled_from(
    [
        "\n", "\r\n", " ", "\t", "\u3000", *"<>()[]{},;:'\"`“”«»\\/|*#_-+.!?=＜＞（）🎯é",
        "'''", '"""', "''')>", ")>", "0x", "0x1f", "3", "-4.5", "1e9", "#", "**", "<b>", "</b>", "<think>", "</think>",
        "Team", "team", "Stalker-1", "A", "Actions:", "Analysis:", "Communications:", "[THINK]", "Stop", "Attack_Unit",
        '{"action": "', '"args": [', '"team": "A"', "&lt;", "&gt;", "&#39;", "\\n", '\\"', "~~", "<!--",
        "-->", "do not ", "User:", "、",
        "动作：", "Final actions:", "Valid actions:", "</Attack_Unit>", "◁think▷", "<|message|>", "<|channel|>analysis",
        "MessageTo", "ListenTo", "<MessageTo(A, ", "<Attack_Unit(", "<Move_Screen([", "<Stop()>",
    ]
)  # fmt: skip
TEXTS = st.one_of(st.text(), st.lists(st.one_of(FRAGMENTS, st.text(max_size=3)), max_size=60).map("".join))


@given(TEXTS)
def test_no_text_raises_and_all_is_where_it_is_said_to_be(text: str) -> None:
    speech = parse(text)
    for call in speech.calls + speech.mentions:
        alone = parse(text[call.start : call.end])
        assert [(one.name, one.args) for one in alone.calls] == [(call.name, call.args)]
        assert (alone.calls[0].start, alone.calls[0].end) == (0, call.end - call.start)
    for fault in speech.faults:
        assert text[fault.start :].startswith(fault.text)
        assert fault.text
    for message in speech.messages:
        alone = parse(text[message.start : message.end])
        assert alone.messages == (MessageTo(message.recipient, message.text, 0, message.end - message.start),)
    for listen in speech.listens:
        alone = parse(text[listen.start : listen.end])
        assert ListenTo(listen.channel, 0, listen.end - listen.start) in alone.listens


@given(TEXTS)
def test_what_was_read_is_rendered_so_that_it_reads_the_same(text: str) -> None:
    for call in parse(text).calls:
        again = parse(render(call)).calls
        assert [(one.name, one.args) for one in again] == [(call.name, call.args)]


@given(TEXTS)
def test_nothing_overlaps_and_all_is_in_order(text: str) -> None:
    speech = parse(text)
    spans = sorted(
        {(item.start, item.end) for item in speech.calls + speech.mentions + speech.messages + speech.listens}
    )
    assert all(before[1] <= after[0] for before, after in pairwise(spans))
    starts = [call.start for call in speech.calls]
    assert starts == sorted(starts)


NAMES = st.from_regex(r"[A-Z][a-z]{1,8}(_[A-Z][a-z]{1,8}){0,3}", fullmatch=True)
TAGS = st.integers(0, 2**40).map(hex)
POINTS = st.tuples(*[st.floats(-200, 200).map(lambda x: round(x, 3) + 0.0)] * 2)
CALLS = st.builds(
    Call,
    name=NAMES,
    args=st.lists(st.one_of(TAGS, POINTS), max_size=3).map(tuple),
    team=st.none(),
    start=st.just(0),
    end=st.just(0),
)
PROSE = st.text(
    alphabet=st.characters(exclude_characters="<＜>\\:：[【(（", exclude_categories=["Cs", "Cc", "Zl", "Zp"]),
    max_size=30,
)


@given(st.lists(st.tuples(CALLS, PROSE), max_size=8))
def test_rendered_calls_with_words_between_are_read_back(pieces: list[tuple[Call, str]]) -> None:
    text = "Actions:\n" + "".join(f"{render(call)} {words}\n" for call, words in pieces)
    assert [(call.name, call.args) for call in parse(text).calls] == [(call.name, call.args) for call, _ in pieces]


HARD = [
    *("<", "<A_b(", "<A_b(((((", "<A_b\\", "< ", "<a>", "</a>", "> ", "\n", "a\n", "a: ", "-", "_", "1. ", "A_b("),
    *("<MessageTo(A, '''", '<MessageTo(A, "x', "<MessageTo(A, x", "<MessageTo(A <", "''')>", "'", "<ListenTo("),
    *("<think>", "</think>", "Team A ", "Team A (", "Team A:\n", "Actions:\n", ". Actions: ", "<Stop()>", "a a a "),
    *('{"a":', '{"action":', '{"action": "a_b", "a":', '"team":', '"team": "A"', "A_b 0x1 ", "MessageTo(A, '"),
    *("MessageTo(A, x", "&lt;", "\\n", "~~", "<A B C ", "no ", "Team A should ", "<0x1>", "<A_b ", "<A_b>", "<!--"),
    *('["A_b(', "<MessageTo>", '<MessageTo to="A" ', "<A_b(0x1 0x1 ", "<A_b(x=1, ", "A-1 | "),
    *("动作", "Final actions:\n<A_b()>\n", "(0x1 "),
    *("A_b(())", "<MessageTo(A, '''<MessageTo(A, \"<MessageTo(A, “", "<A(" + "1, " * 50 + ")>"),
]  # fmt: skip


def seconds(text: str) -> float:
    begin = time.process_time()
    parse(text)
    return time.process_time() - begin


@pytest.mark.parametrize("prefix", ["", pytest.param("<MessageTo(A, '", marks=pytest.mark.slow)])
@pytest.mark.parametrize("piece", HARD)
def test_time_grows_with_the_length_and_no_faster(piece: str, prefix: str) -> None:
    short, long = (prefix + piece * (size // len(piece)) for size in (5_000, 20_000))
    short_s = min(seconds(short) for _ in range(3))
    assert any(seconds(long) < 8 * short_s + 0.02 for _ in range(3))  # 4 if it is linear, 16 if it is quadratic


@pytest.mark.parametrize(
    "text",
    [REPLY * 600, "".join(piece * (7_000 // len(piece)) for piece in HARD if "hink" not in piece)],
    ids=["a reply", "everything hard"],
)
def test_two_hundred_kilobytes_take_less_than_a_second(text: str) -> None:
    assert min(seconds(text[:200_000]) for _ in range(2)) < 1.0
