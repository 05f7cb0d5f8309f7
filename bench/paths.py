"""Places in the repository that benchmarks read and write."""

from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parent.parent
RESULTS: Final = ROOT / "bench" / "results"
TESTS: Final = ROOT / "tests"
GOLDEN: Final = TESTS / "khala" / "golden.mcap"
"""The recording of a short match that was really played."""
