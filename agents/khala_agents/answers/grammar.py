"""An agent's choices → a grammar of its answer in the text language, in GBNF, as llama.cpp and vLLM take it.

The answer is an analysis of one line, orders for each team at most once and at least one in all, and then messages. A
text that follows the grammar is well formed, and names only teams, actions, tags and places that the choices have.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_agents.answers.schema import MOST_LINES, TEXT_CHARACTERS, written_point

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_agents.answers.choices import Argument, Choices, Option

MESSAGE_CHARACTERS: Final = 200
_ANY_TAG: Final = '"0x" [0-9a-f]{5,16}'
_END: Final = "[A-Za-z0-9: ]{1,40}"


def answer_grammar(choices: Choices) -> str:
    """Return the grammar; its root is called `root`."""
    return "\n".join(f"{name} ::= {rule}" for name, rule in _Rules(choices).made.items()) + "\n"


class _Rules:
    def __init__(self, choices: Choices) -> None:
        self._choices = choices
        self.made: dict[str, str] = {"root": ""}
        self._names: dict[str, str] = {}
        lines = list(self._lines())
        orders = f'"Actions:\\n" {self._orders()}' if choices.options else ""
        if lines:
            self.made["talk"] = f'"Communications:\\n" ("    <" ({" | ".join(lines)}) ")>\\n"){{1,{MOST_LINES}}}'
        behind = {(True, True): f"({orders} talk? | talk)", (True, False): orders, (False, True): "talk?"}
        rest = behind.get((bool(orders), bool(lines)), "")
        self.made["root"] = f'"Analysis: " [^\\n<]{{1,{TEXT_CHARACTERS}}} "\\n" {rest}'.rstrip()

    def _orders(self) -> str:
        """Return the orders of one team or more, in the order of the teams."""
        teams = [self._team(place, team) for place, team in enumerate(self._choices.teams)]
        optional = [f"{team}?" for team in teams]
        from_here = [" ".join([team, *optional[place + 1 :]]) for place, team in enumerate(teams)]
        return f"({' | '.join(from_here)})"

    def _team(self, place: int, team: str) -> str:
        calls = " | ".join(self._calls(self._choices.of_team(team)))
        call = self._rule(f"call{place}", calls)
        line = f'"<" {call} ")>\\n"'
        if self._choices.stands:
            line = f'"<" ({call} ")>\\n" | "Standing(" {call} "), until " {_END} ")>\\n")'
        orders = f'("        " {line}){{1,{self._choices.most}}}'
        return self._rule(f"team{place}", f'{_quote(f"    Team {team}:")} "\\n" {orders}')

    def _calls(self, options: Iterable[Option]) -> Iterator[str]:
        """Yield calls without what closes them, those with the same arguments together."""
        alike: dict[tuple[Argument, ...], list[str]] = {}
        for option in options:
            alike.setdefault(option.arguments, []).append(option.action.name)
        for arguments, names in alike.items():
            values = ' ", " '.join(map(self._value, arguments))
            yield f'{_any(names)} "(" {values}'.rstrip()

    def _value(self, argument: Argument) -> str:
        if argument.bounds is None:
            return self._rule("tag", _any(argument.tags) if argument.tags else _ANY_TAG)
        if argument.points:
            return self._rule("place", _any(map(written_point, argument.points)))
        x0, y0, x1, y1 = argument.bounds
        across = self._rule("number", _numbers(x0, x1))
        return f'"[" {across} ", " {self._rule("number", _numbers(y0, y1))} "]"'

    def _lines(self) -> Iterator[str]:
        """Yield what may stand under communications, without the brackets around it."""
        words = f"\"'''\" [^'<>\\n]{{1,{MESSAGE_CHARACTERS}}} \"'''\""
        if self._choices.recipients:
            yield f'"MessageTo(" {_any(self._choices.recipients)} ", " {words}'
        if self._choices.channels:
            yield f'"ListenTo(" {_any(self._choices.channels)}'
        if self._choices.keeps_notes:
            yield f'"Note(" {words}'
        if self._choices.notes:
            yield f'"Forget(" {_any(map(str, self._choices.notes))}'
        if self._choices.standing:
            yield f'"Revoke(" {_any(map(str, self._choices.standing))}'

    def _rule(self, name: str, rule: str) -> str:
        """Return the name of a rule, which is made if there is none like it."""
        if rule not in self._names:
            taken = name in self.made
            self._names[rule] = f"{name}-{len(self.made)}" if taken else name
            self.made[self._names[rule]] = rule
        return self._names[rule]


def _numbers(low: float, high: float) -> str:
    """Return numbers in a range, with a tenth or without."""
    first = -int(-low // 1)
    last = int(high)
    if first >= last:
        return f'"{last}"'
    below = _any(str(number) for number in range(first, last))
    return f'({below} ("." [0-9])? | "{last}")'


def _any(words: Iterable[str]) -> str:
    quoted: Sequence[str] = [_quote(word) for word in words]
    return quoted[0] if len(quoted) == 1 else f"({' | '.join(quoted)})"


def _quote(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
