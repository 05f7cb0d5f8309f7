"""Run a program that uses PySC2 4.0.0 on Python 3.11 or newer.

    python -m khala_simulator.pysc2 my_program.py --its --options
    python -m khala_simulator.pysc2 -m pysc2.bin.agent --map Simple64

PySC2 shuffles its colours with `random.shuffle(palette, function)` when it is imported, and Python 3.11 removed the
second parameter: `import pysc2.env.sc2_env` ends in `shuffle() takes 2 positional arguments but 3 were given`. Here
that parameter is there again, in this process alone; PySC2 stays as it was installed. A program that is started by
others, as a notebook is, calls `restore_shuffle()` before it imports PySC2.

Khala itself restores the parameter for the import alone (`khala_bridge.compat`), which the simulator does not know.
"""

from __future__ import annotations

import random
import runpy
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, MutableSequence

USAGE = "Usage: python -m khala_simulator.pysc2 (PROGRAM.py | -m MODULE) [ARGUMENT]...\n\n"


def restore_shuffle() -> None:
    """Give `random.shuffle` of this process the second parameter that it had up to Python 3.10; again is no harm."""
    shuffle = random.shuffle

    def shuffle_as_before(x: MutableSequence[object], random: Callable[[], float] | None = None) -> None:
        if random is None:
            shuffle(x)
            return
        for i in reversed(range(1, len(x))):
            j = int(random() * (i + 1))
            x[i], x[j] = x[j], x[i]

    if shuffle.__name__ != shuffle_as_before.__name__:
        random.shuffle = shuffle_as_before


def main(arguments: list[str] | None = None) -> None:
    """Run the program that the command line names, as Python itself would."""
    words = sys.argv[1:] if arguments is None else arguments
    is_module = words[:1] == ["-m"]
    program = words[is_module:]
    if not program or program[0] in {"-h", "--help"}:
        text = USAGE + (__doc__ or "")
        (sys.stdout if program else sys.stderr).write(text)
        sys.exit(0 if program else 2)
    if not is_module and not Path(program[0]).is_file():
        sys.exit(f"there is no program {program[0]}; a module is named with -m")
    restore_shuffle()
    sys.argv = program
    if is_module:
        sys.path.insert(0, "")
        runpy.run_module(program[0], run_name="__main__", alter_sys=True)
    else:
        sys.path.insert(0, str(Path(program[0]).resolve().parent))
        runpy.run_path(program[0], run_name="__main__")


if __name__ == "__main__":
    main()
