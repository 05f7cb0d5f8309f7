"""The text language: a reply's text → the calls in it, with their places.

    Analysis: free text
    Actions:
        Team Stalker-1:
            <Attack_Unit(0x1008c0001)>
            <Move_Screen([20, 9])>
    Communications:
        <MessageTo(CombatGroup1, '''hold the ramp''')>
        <ListenTo(Channel-2)>

`parse` is tolerant as models need it and exact in what it reports: whatever looks like a call and is none is a
`Rejection` with its place and a sentence that the model can act on, and costs nothing but itself. Nothing
raises, the time is linear in the length of the text, and a call that is not closed is never guessed at.

This package knows no unit, no action and no game: whether a name, a tag or a team exists is the bridge's to
say. The rules of tolerance, beside those of headings (H, `protocol.speech.headings`) and of arguments
(A, `protocol.speech.arguments`); each has a row in the table test:

| id | rule | example |
|---|---|---|
| S1 | calls without any heading count | `<Stop()>` |
| S2 | several calls on a line, words around them | `first <Stop()>, then <Hold_Position()>` |
| S3 | blanks and line breaks within a call | `< Attack_Unit ( 0x1 ) >` |
| S4 | a call without arguments needs no parentheses | `<Hold_Position>`, `<Hold_Position/>` |
| S5 | markdown around a call and escapes within: bullets, numbers, emphasis, fences, quotes | `- **<Stop()>**` |
| S6 | full-width brackets, commas, colons and digits, as some input methods write them | |
| S7 | tags of markup and comparison signs are no calls and no faults | `<b>`, `health < 50 and > 20` |
| S8 | what stands in a reasoning block is not said | `<think><Stop()></think>` |
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
"""

from protocol.speech.arguments import render
from protocol.speech.reader import ListenTo, MessageTo, Speech, parse

__all__ = ["ListenTo", "MessageTo", "Speech", "parse", "render"]
