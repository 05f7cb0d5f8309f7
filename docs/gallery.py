"""Play the matches of docs/gallery.md and export their pages into docs/gallery: `python -m docs.gallery`.

Each `khala run … --run NAME` of that page is played as it stands there, and becomes docs/gallery/NAME.html. A page that
is already there stays. `make docs` makes the pages for the site; git ignores them. `python -m docs.gallery --pictures`
also draws their thumbnails in Chromium, docs/images/gallery, which are committed.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

DOCS = Path(__file__).parent
PAGE = DOCS / "gallery.md"
OUT = DOCS / "gallery"
PICTURES = DOCS / "images" / "gallery"
RUN = re.compile(r"^khala (?P<arguments>run .*--run (?P<name>\w+).*)$", re.MULTILINE)


def matches(page: str) -> dict[str, list[str]]:
    """Return the arguments of each `khala run` of a page, by the name of its run."""
    return {found["name"]: shlex.split(found["arguments"]) for found in RUN.finditer(page)}


def export(commands: Mapping[str, list[str]], out: Path) -> list[Path]:
    """Play the matches whose pages are missing in a directory; return the pages that it wrote."""
    out.mkdir(parents=True, exist_ok=True)
    missing = {out / f"{name}.html": arguments for name, arguments in commands.items()}
    missing = {path: arguments for path, arguments in missing.items() if not path.exists()}
    with tempfile.TemporaryDirectory() as directory:
        for path, arguments in missing.items():
            khala(directory, *arguments, "--latency", "0")
            khala(directory, "view", f"runs/{path.stem}/recording.mcap", "--export", str(path.resolve()))
            sys.stderr.write(f"{path}: {path.stat().st_size / 1e6:.1f} MB\n")
    return list(missing)


def khala(directory: str, *arguments: str) -> None:
    """Call khala in a directory; say what it printed if it fails."""
    command = [sys.executable, "-m", "khala_sc2", *arguments]
    ended = subprocess.run(command, cwd=directory, capture_output=True, text=True, check=False)  # noqa: S603  # ours
    if ended.returncode:
        raise SystemExit(f"khala {shlex.join(arguments)} ended with {ended.returncode}:\n{ended.stdout}{ended.stderr}")


if __name__ == "__main__":
    export(matches(PAGE.read_text(encoding="utf-8")), OUT)
    if "--pictures" in sys.argv[1:]:
        from docs.view_pictures import draw_exports

        draw_exports(sorted(OUT.glob("*.html")), PICTURES)
