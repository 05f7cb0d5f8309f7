"""The page of `khala --help`."""

from __future__ import annotations

import pytest
import typer.main
from typer.core import TyperGroup

from khala_sc2.cli import app
from khala_sc2.commands.help import Commands


@pytest.mark.parametrize("columns", ["60", "80", "200"])
@pytest.mark.parametrize("colours", ["", "1"])
def test_the_page_is_the_one_that_typer_prints(
    columns: str, colours: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setenv("FORCE_COLOR", colours)
    front = typer.main.get_command(app)
    assert isinstance(front, Commands)
    context = front.context_class(front, info_name="khala")
    front.format_help(context, context.make_formatter())
    ours = capsys.readouterr().out
    TyperGroup.format_help(front, context, context.make_formatter())
    assert ours == capsys.readouterr().out
    assert ("\x1b[" in ours) is bool(colours)
