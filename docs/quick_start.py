"""Run the notebook docs/quick-start.ipynb and keep what it printed in it: `python -m docs.quick_start`.

After a change of an observation or of a rule of the game its outputs are old; the slow test of the notebook says so.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbclient
import nbformat

NOTEBOOK = Path(__file__).parent / "quick-start.ipynb"
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def read() -> Any:
    """Return the notebook as it is kept."""
    return nbformat.read(NOTEBOOK, as_version=4)  # type: ignore[no-untyped-call]  # it has no types


def execute(notebook: Any) -> None:
    """Run all cells of a notebook, with the khala of this Python; each printed text becomes one output."""
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    with tempfile.TemporaryDirectory() as directory:
        resources = {"metadata": {"path": directory}}
        nbclient.NotebookClient(
            notebook, timeout=500, record_timing=False, coalesce_streams=True, resources=resources
        ).execute()


def main() -> None:
    """Run the notebook and write it with its outputs."""
    notebook = read()
    execute(notebook)
    # nbclient adds the version of this Python
    notebook.metadata = {"kernelspec": KERNEL, "language_info": {"name": "python"}}
    nbformat.write(notebook, NOTEBOOK)  # type: ignore[no-untyped-call]
    sys.stdout.write(f"{NOTEBOOK}: {NOTEBOOK.stat().st_size / 1000:.0f} kB\n")


if __name__ == "__main__":
    main()
