"""Foreign text on a terminal: every character is seen, and none acts."""

from __future__ import annotations

import logging
import sys
import unicodedata

import pytest

from khala_protocol.commandline import run_command
from khala_protocol.errors import KhalaError
from khala_protocol.visible import VisibleFormatter, visible, visible_line

ACTING = [
    *map(chr, (*range(0x20), *range(0x7F, 0xA0))),  # C0, DEL, C1
    *map(chr, (0xAD, 0x61C, 0x200B, 0x200C, 0x200D, 0x200E, 0x200F, 0x2028, 0x2029, 0x2060, 0xFEFF)),
    *map(chr, (*range(0x202A, 0x202F), *range(0x2066, 0x206A), 0xD800, 0xDFFF, 0xE0041)),
]


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b]0;title\x07", r"\x1b]0;title\x07"),
        ("\x1b]52;c;YWJj\x1b\\", r"\x1b]52;c;YWJj\x1b" + "\\"),
        ("\x9b2J", r"\x9b2J"),
        ("a\u202eb", r"a\u202eb"),
        ("\ud800", r"\ud800"),
        ("Zürich 动作\u3000🙂\tok\n", "Zürich 动作\u3000🙂\tok\n"),
    ],
    ids=["title", "clipboard", "8-bit", "direction", "surrogate", "ordinary"],
)
def test_what_acts_on_a_terminal_is_seen_instead(text: str, shown: str) -> None:
    assert visible(text) == shown


def test_no_character_that_acts_is_left() -> None:
    assert all(visible(character).isprintable() for character in set(ACTING) - {"\n", "\t"})


@pytest.mark.slow
def test_every_character_is_printable_or_a_blank() -> None:
    left = {unicodedata.category(shown) for code in range(sys.maxunicode + 1) for shown in visible(chr(code))}
    assert left.isdisjoint({"Cf", "Cs", "Co", "Cn", "Zl", "Zp"})


def test_a_line_stays_a_line() -> None:
    assert visible_line(" a\r\nb\u2028c\x1b[2J ") == r"a b c\x1b[2J"


def test_an_error_of_the_command_line_is_visible(capsys: pytest.CaptureFixture[str]) -> None:
    def fail() -> None:
        raise KhalaError("no file \x1b[2J")

    with pytest.raises(SystemExit):
        run_command("khala", fail)
    assert capsys.readouterr().err == "khala: no file \\x1b[2J\n"


def test_a_line_of_a_log_is_visible() -> None:
    record = logging.LogRecord("a", logging.ERROR, "", 0, "said %s", ("\x1b[2J",), None)
    assert VisibleFormatter("%(message)s").format(record) == r"said \x1b[2J"
