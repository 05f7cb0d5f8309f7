"""How plain the language is: archaic and private words in docstrings, comments and pages, by word and by place.

    python -m bench.words                  counts of this tree
    python -m bench.words --places whom    every place of one word, to correct it
    python -m bench.words --tree OTHER     counts of another checkout

`Returns`, `Raises` and the like count where they begin a docstring, which should be in the imperative: "Return …".
Generated pages and the words of commands to the game ("let go") count as any other.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import subprocess
import tokenize
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from bench.paths import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator

WORDS = (
    "whom",
    "whoever",
    "those who",
    "anew",
    "alike",
    "besides",
    "told",
    "lay",
    "lays",
    "bury",
    "law",
    "laws",
    "let",
    "lets",
)
HE = ("he", "his", "him")
FIRST_VERBS = {
    "Adds", "Asks", "Begins", "Builds", "Calls", "Checks", "Closes", "Counts", "Draws", "Ends", "Finds", "Gets",
    "Gives", "Goes", "Keeps", "Makes", "Moves", "Opens", "Plays", "Prints", "Publishes", "Puts", "Raises", "Reads",
    "Removes", "Returns", "Runs", "Says", "Sends", "Sets", "Shows", "Starts", "Stops", "Takes", "Tells", "Turns",
    "Waits", "Writes",
}  # fmt: skip


def passages(path: Path) -> Iterator[tuple[int, str, bool]]:
    """Yield line, text, and whether it is a function's docstring, of all text for people in a file."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        for number, line in enumerate(text.splitlines(), start=1):
            yield number, line, False
        return
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if (said := ast.get_docstring(node, clean=False)) is not None:
            is_function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
            for offset, line in enumerate(said.splitlines()):
                yield node.body[0].lineno + offset, line, is_function and offset == 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string, False


def found(tree: Path) -> Iterator[tuple[str, str]]:
    """Yield every counted word and its place, `path:line`."""
    listed = subprocess.run(["git", "ls-files", "*.py", "*.md"], cwd=tree, capture_output=True, text=True, check=True)
    for name in listed.stdout.split():
        if name == "bench/repository/words.py" or "corpus" in name:
            continue
        for line, text, opens in passages(tree / name):
            for word in (*WORDS, *HE):
                for _ in re.finditer(rf"\b{word}\b", text, re.IGNORECASE):
                    yield word, f"{name}:{line}"
            if opens and text.partition(" ")[0] in FIRST_VERBS:
                yield "Returns …", f"{name}:{line}"


def main() -> None:
    """Print the counts, or the places of one word."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tree", type=Path, default=ROOT, help="the checkout to read")
    parser.add_argument("--places", metavar="WORD", help="print where this word is")
    options = parser.parse_args()
    everything = list(found(options.tree))
    if options.places:
        print("\n".join(place for word, place in everything if word == options.places))
        return
    counts = Counter(word for word, _ in everything)
    for word in (*WORDS, *HE, "Returns …"):
        print(f"{word:10} {counts[word]:5}")
    print(f"{'all':10} {sum(counts.values()):5}")


if __name__ == "__main__":
    main()
