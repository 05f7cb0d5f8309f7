"""The text language: a reply's text → the calls in it, with their places.

    Analysis: free text
    Actions:
        Team Stalker-1:
            <Attack_Unit(0x1008c0001)>
            <Move_Screen([20, 9])>
    Communications:
        <MessageTo(CombatGroup1, '''hold the ramp''')>
        <ListenTo(Channel-2)>

An agent also keeps notes and gives standing orders: `<Note('''text''')>`, `<Forget(2)>`,
`<Standing(Train_Probe(), until 22 Probe)>`, `<Revoke(1)>`.

`parse` tolerates what models write and is exact in what it reports: text with only one possible meaning is read as
that, any other text that looks like a call is a `Rejection` with its place and a sentence that the model can act on,
and affects nothing else. Nothing raises, the time is linear in the length of the text (a reply is read up to
`MAX_REPLY_CHARACTERS`, and up to 4 000 lines and 1 000 calls), and a call that is cut off is never guessed at.

This package knows no unit, no action and no game: the bridge decides whether a name, a tag or a team exists.
These are the rules of tolerance, in addition to those of headings (H, `khala_protocol.speech.headings`), of arguments
(A, `khala_protocol.speech.arguments`) and of what only repeats the prompt (E, `khala_protocol.speech.echoes`); each has
a row in the table test:

| id | rule | example |
|---|---|---|
| S1 | calls without any heading count | `<Stop()>` |
| S2 | several calls on a line, words around them | `first <Stop()>, then <Hold_Position()>` |
| S3 | blanks and line breaks within a call | `< Attack_Unit ( 0x1 ) >` |
| S4 | a call without arguments needs no parentheses | `<Hold_Position>`, `<Hold_Position/>` |
| S5 | markdown around a call and escapes within: bullets, numbers, emphasis, fences, quotes | `- **<Stop()>**` |
| S6 | full-width brackets, commas, colons and digits, as some input methods write them | |
| S7 | tags of markup and comparison signs are neither calls nor faults | `<b>`, `health < 50 and > 20` |
| S8 | a reasoning block is not said | `<think><Stop()></think>` |
| S9 | a closing reasoning tag alone ends a block that began before the reply | `<Stop()></think>` |
| S10 | with a heading `Actions`, calls in the analysis or above any heading are mentions | `Analysis: <Stop()>?` |
| S11 | the same for messages and a heading `Communications` | `Analysis: <MessageTo(A, 'go')>?` |
| S12 | a heading may be missing, repeated or out of order; every call under one counts | `Communications:` first |
| S13 | a team's heading holds until the next one; a section's heading forgets it | `Team A:` … `Actions:` |
| S14 | … but not if it stands directly above, as when every team has sections of its own | `Team A:` / `Analysis:` |
| S15 | a message between quotes of any kind: single, double, triple, back-ticks, typographic | `"go"` |
| S16 | line breaks, brackets, `>`, quotes and whole calls in a quoted message | `'''(now) -> <Stop()>'''` |
| S17 | a message without quotes, or with one not closed, ends with its `)>` on the line | `<MessageTo(A, go)>` |
| S18 | quotes, brackets or a keyword at a recipient; a comma left out | `<MessageTo(to="A" text="go")>` |
| S19 | names of the two messages in any case, with an underscore or without | `<message_to(A, 'go')>` |
| S20 | several channels in one call | `<ListenTo(Channel-1, Channel-2)>` |
| S21 | a name with blanks is one with underscores | `<Attack Unit(0x1)>` |
| S22 | a bracket too few or too many before a `>` on the line; no `>` where the line ends | `<Stop(>`, `<Stop()` |
| S23 | a call without angle brackets that stands alone, behind a heading or in a list of JSON | `- Stop()` |
| S24 | a comment or struck out text is not said | `<!-- <Stop()> -->`, `~~<Stop()>~~` |
| S25 | nor is a call right after a negation, in many languages | `do not <Stop()>`, `instead of <Stop()>` |
| S26 | a made-up turn of another speaker ends the reply | `User:` |
| S27 | a section that repeats an earlier one under the same heading counts once | the whole reply twice |
| S28 | a call as an object of JSON | `{"action": "Attack_Unit", "args": ["0x1"]}` |
| S29 | a call as an element or with attributes | `<Attack_Unit>0x1</Attack_Unit>`, `<Attack_Unit tag="0x1"/>` |
| S30 | tags and points in other brackets or in none | `<Attack_Unit[0x1]>`, `<Attack_Unit 0x1>` |
| S31 | entities of HTML, escaped quotes and line ends, a tag between angle brackets | `&lt;Stop()&gt;` |
| S32 | reasoning between other marks, or in a channel of its own | `◁think▷` … `◁/think▷` |
| S33 | a message without angle brackets, as an element, with three quotes and `>` | `MessageTo(A, 'go')` |
| S34 | a note wherever it stands, quoted like a message; of several numbers, each | `<Note(go)>`, `<Forget(1, 2)>` |
| S35 | brackets or none around the call of a standing order; no "until" | `<Standing(<Stop()>, 4:30)>` |
| S36 | a message that is written again in the same reply is sent once | `<MessageTo(A, 'go')>` twice |
| S37 | a tool call as text, as models of several makers write it | `<invoke name="Stop">` … |
| S38 | an item of a list of YAML | `- action: Move_Screen`, then `screen: [3, 4]` |
| S39 | a team as an argument, or behind a call without angle brackets | `Stop(team="A")`, `Stop() for A-1` |
| S40 | a made-up observation ends the reply, once orders stand before it | `Game`, then `Time: 1:20` |
| S41 | a reply that is one object of JSON: only what stands in its lists counts | `{"orders": [`…`]}` |
| S42 | an end of an order in JSON makes it a standing order | `{"action": "Train_Probe", "until": "22 Probe"}` |
"""

from khala_protocol.messages import MAX_REPLY_CHARACTERS
from khala_protocol.speech.arguments import render, written
from khala_protocol.speech.echoes import NOTHING_SHOWN, ShownText
from khala_protocol.speech.reader import parse
from khala_protocol.speech.said import Forget, ListenTo, MessageTo, Note, Revoke, Speech, Standing
from khala_protocol.speech.thoughts import thought_of

__all__ = [
    "MAX_REPLY_CHARACTERS",
    "NOTHING_SHOWN",
    "Forget",
    "ListenTo",
    "MessageTo",
    "Note",
    "Revoke",
    "ShownText",
    "Speech",
    "Standing",
    "parse",
    "render",
    "thought_of",
    "written",
]
