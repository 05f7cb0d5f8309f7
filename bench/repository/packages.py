"""The size of an installation of each part: megabytes and packages, from wheels, in fresh environments.

    python -m bench packages

The megabytes are those of `site-packages` before anything was compiled.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from bench.paths import ROOT

UV = shutil.which("uv") or str(ROOT / ".uv" / "bin" / "uv")
PARTS = {"agents only": "khala-agents", "simulator only": "khala-simulator", "everything": "khala"}


def run(*command: object, cwd: Path) -> str:
    """Return the output of a command."""
    return subprocess.run([*map(str, command)], check=True, capture_output=True, text=True, cwd=cwd).stdout


def measure(distribution: str, wheels: Path, directory: Path) -> tuple[float, list[str]]:
    """Return the megabytes and names of everything that one distribution brings."""
    target = directory / distribution
    run(UV, "venv", "--quiet", "--python", sys.executable, target, cwd=directory)
    run(UV, "pip", "install", "--quiet", "--python", target, "--find-links", wheels, distribution, cwd=directory)
    (packages,) = target.glob("lib/python*/site-packages")
    size = sum(file.stat().st_size for file in packages.rglob("*") if file.is_file() and not file.is_symlink())
    names = sorted(path.name.partition("-")[0].lower() for path in packages.glob("*.dist-info"))
    return size / 1e6, names


def main() -> None:
    """Build the wheels, install each part, and print the sizes."""
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        run(UV, "build", "--quiet", "--all-packages", "--wheel", "--out-dir", directory / "wheels", cwd=ROOT)
        for part, distribution in PARTS.items():
            size_mb, names = measure(distribution, directory / "wheels", directory)
            print(f"{part:15} {size_mb:5.0f} MB  {len(names):3} packages: {', '.join(names)}")
