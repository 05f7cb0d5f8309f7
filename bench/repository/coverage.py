"""Print the coverage of each package; `make cover` fails if a named one has less than it should.

    python -m bench coverage .coverage.json --at-least 90 protocol agents

It reads the JSON report of coverage.py. A package's figure is the share of its lines and of its branches together, as
coverage.py counts them.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

from bench.command_line import make_parser

COUNTED = ("num_statements", "covered_lines", "num_branches", "covered_branches")


def by_package(report: Path) -> dict[str, Counter[str]]:
    """Return the counts of the files of each package."""
    found: dict[str, Counter[str]] = {}
    for name, file in json.loads(report.read_text(encoding="utf-8"))["files"].items():
        counts = {count: file["summary"][count] for count in COUNTED}
        found.setdefault(Path(name).parts[0], Counter()).update(counts)
    return dict(sorted(found.items()))


def share(counts: Counter[str]) -> float:
    """Return the per cent of lines and branches."""
    there = counts["num_statements"] + counts["num_branches"]
    return 100 * (counts["covered_lines"] + counts["covered_branches"]) / there if there else 100.0


def main() -> None:
    """Print the table; end with 1 if a package is below the threshold."""
    parser = make_parser(__doc__, json=False)
    parser.add_argument("report", type=Path)
    parser.add_argument("packages", nargs="*", help="packages that have to be covered")
    parser.add_argument("--at-least", type=float, default=0.0, metavar="PER_CENT")
    options = parser.parse_intermixed_args()
    found = by_package(options.report)
    print("| package | lines | branches | covered |\n| --- | ---: | ---: | ---: |")
    for name, counts in [*found.items(), ("all", sum(found.values(), Counter[str]()))]:
        print(f"| {name} | {counts['num_statements']} | {counts['num_branches']} | {share(counts):.1f} % |")
    if unknown := [name for name in options.packages if name not in found]:
        raise SystemExit(f"nothing was measured of {', '.join(unknown)}")
    low = [name for name in options.packages if share(found[name]) < options.at_least]
    if low:
        raise SystemExit(f"less than {options.at_least:g} % is covered of {', '.join(low)}")
