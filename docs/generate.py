"""Write docs/reference: `python -m docs.generate`, and with `--check` list the pages that are out of date.

A page is a function in `docs.pages` that returns its text; this module only maps pages to functions. Nothing in
docs/reference is written by hand: change a fact where it is used, and its page follows.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from docs.pages import (
    actions,
    cli,
    configs,
    game,
    knowledge,
    language,
    measures,
    messages,
    observations,
    probes,
    ratings,
    rules,
    simulator,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

REFERENCE = Path(__file__).parent / "reference"

PAGES: dict[str, Callable[[], str]] = {
    "cli.md": cli.page,
    "messages.md": messages.page,
    "measures.md": measures.page,
    "observations.md": observations.page,
    "text-language.md": language.page,
    "tasks.md": game.tasks,
    "actions.md": actions.actions,
    "functions.md": actions.functions,
    "units.md": knowledge.units,
    "abilities.md": knowledge.abilities_page,
    "upgrades.md": knowledge.upgrades_page,
    "maps.md": game.maps,
    "task-files.md": configs.task_files,
    "model-files.md": configs.model_files_page,
    "rules.md": rules.page,
    "simulator.md": simulator.page,
    "probes.md": probes.page,
    "ratings.md": ratings.page,
}


def outdated(directory: Path = REFERENCE) -> list[str]:
    """Return the names of pages that are missing, differ from what would be written, or that no function makes."""
    made = {name: page() for name, page in PAGES.items()}
    found = {path.name: path.read_text(encoding="utf-8") for path in directory.glob("*.md")}
    return sorted(name for name in made.keys() | found.keys() if made.get(name) != found.get(name))


def write(directory: Path = REFERENCE) -> None:
    """Write every page."""
    directory.mkdir(parents=True, exist_ok=True)
    for name, page in PAGES.items():
        (directory / name).write_text(page(), encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code is 1 if pages are out of date."""
    parser = argparse.ArgumentParser(prog="python -m docs.generate", description="Write the pages of docs/reference.")
    parser.add_argument("--check", action="store_true", help="write nothing; fail if a page is out of date")
    if not parser.parse_args(arguments).check:
        write()
        return 0
    if old := outdated():
        sys.stderr.write(f"out of date in docs/reference: {', '.join(old)}; `make docs` writes them\n")
    return 1 if old else 0


if __name__ == "__main__":
    sys.exit(main())
