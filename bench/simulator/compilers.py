"""Compare compilers for a system of the simulator's engine: numpy, numba, mypyc and Cython do the same work.

The work is that of an engaged unit in every loop: for k fighters, the offset to the target, its length and the unit
vector, and whether the target is in reach. Each way runs in a process of its own, which says how long a call takes for
20 and for 200 fighters (medians of CPU time, in us), how long it takes until the first result (import, and for numba
compiling or reading its cache), and the memory that this adds, in MB. All results must be equal to the last bit.

    python -m bench compilers

installs numba, mypy and Cython into an environment of its own first.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from bench.command_line import make_parser
from bench.paths import ROOT
from bench.tables import print_table

UV = shutil.which("uv") or str(ROOT / ".uv" / "bin" / "uv")
SIZES = (20, 200)
NUMPY = """
import numpy as np

def engage(pos, target, reach, toward, near):
    offset = pos.take(target, 0) - pos
    squared = offset * offset
    distance = np.sqrt(squared[:, 0] + squared[:, 1])
    np.divide(offset, distance[:, None], out=toward)
    np.less_equal(distance, reach, out=near)
"""
LOOP = """
def engage(pos, target, reach, toward, near):
    for i in range(target.shape[0]):
        x = pos[target[i], 0] - pos[i, 0]
        y = pos[target[i], 1] - pos[i, 1]
        distance = math.sqrt(x * x + y * y)
        toward[i, 0] = x / distance
        toward[i, 1] = y / distance
        near[i] = distance <= reach[i]
"""
NUMBA = "import math\nimport numba\n\n@numba.njit(cache=True)" + LOOP
MYPYC = "import math\n" + LOOP.replace(
    "(pos, target, reach, toward, near):",
    "(pos: Any, target: Any, reach: Any, toward: Any, near: Any) -> None:",
).replace("\ndef", "\nfrom typing import Any\n\ndef").replace("x = pos", "x: float = pos").replace(
    "y = pos", "y: float = pos"
)
CYTHON = """
# cython: boundscheck=False, wraparound=False, cdivision=True, language_level=3
from libc.math cimport sqrt
from libc.stdint cimport int64_t, uint8_t

def engage(double[:, ::1] pos, int64_t[::1] target, double[::1] reach, double[:, ::1] toward, uint8_t[::1] near):
    cdef Py_ssize_t i
    cdef double x, y, distance
    for i in range(target.shape[0]):
        x = pos[target[i], 0] - pos[i, 0]
        y = pos[target[i], 1] - pos[i, 1]
        distance = sqrt(x * x + y * y)
        toward[i, 0] = x / distance
        toward[i, 1] = y / distance
        near[i] = distance <= reach[i]
"""
BUILD = """
from mypyc.build import mypycify
from Cython.Build import cythonize
from setuptools import Extension, setup
flags = ["-O2", "-ffp-contract=off"]
cython = cythonize([Extension("with_cython", ["with_cython.pyx"], extra_compile_args=flags)], quiet=True)
setup(name="compilers", ext_modules=[*mypycify(["with_mypyc.py"]), *cython])
"""
MEASURE = """
import hashlib, importlib, json, sys, time
import numpy as np

def resident():
    return int(open("/proc/self/status").read().partition("VmRSS:")[2].split()[0]) / 1024

def world(k):
    chance = np.random.default_rng(k)
    near = np.zeros(k, dtype=np.uint8 if sys.argv[1] == "with_cython" else np.bool_)
    return chance.uniform(0, 32, (k, 2)), np.roll(np.arange(k), 1), chance.uniform(1, 9, k), np.zeros((k, 2)), near

small, before, began = world(20), resident(), time.perf_counter()
engage = importlib.import_module(sys.argv[1]).engage
engage(*small)
said = {"start_ms": (time.perf_counter() - began) * 1e3, "mb": resident() - before, "us": []}
sha = hashlib.sha256()
for k in json.loads(sys.argv[2]):
    arrays, times = world(k), []
    for _ in range(15):
        began = time.process_time()
        for _ in range(500):
            engage(*arrays)
        times.append((time.process_time() - began) / 500 * 1e6)
    said["us"].append(sorted(times)[len(times) // 2])
    sha.update(arrays[3].tobytes() + arrays[4].tobytes())
said["result"] = sha.hexdigest()
print(json.dumps(said))
"""


def measure(folder: Path, python: str) -> dict[str, dict[str, Any]]:
    """Build all ways in a folder, and return what each measured; numba twice, without and with its cache."""
    ways = {"with_numpy.py": NUMPY, "with_numba.py": NUMBA, "with_mypyc.py": MYPYC, "with_cython.pyx": CYTHON}
    for name, text in {**ways, "build.py": BUILD, "measure.py": MEASURE}.items():
        (folder / name).write_text(text, encoding="utf-8")
    _run(python, "build.py", "-q", "build_ext", "--inplace", folder=folder)
    said = {}
    for label, module in (
        ("numpy", "with_numpy"), ("numba, first run", "with_numba"), ("numba, from its cache", "with_numba"),
        ("mypyc", "with_mypyc"), ("Cython", "with_cython"),
    ):  # fmt: skip
        said[label] = json.loads(_run(python, "measure.py", module, json.dumps(SIZES), folder=folder))
    return said


def _run(*command: str, folder: Path | None = None) -> bytes:
    """Return the output of a command."""
    return subprocess.run(command, cwd=folder, check=True, capture_output=True).stdout


def main() -> None:
    """Build and measure all ways, and print a row for each."""
    make_parser(__doc__, json=False).parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        environment = folder / "environment"
        _run(UV, "venv", "--quiet", "--python", sys.executable, str(environment))
        python = str(environment / "bin" / "python")
        _run(UV, "pip", "install", "--quiet", "--python", python, "numba", "mypy", "cython", "setuptools", "numpy")
        rows = measure(folder, python)
    print_table(
        ("compiler", *(f"us for {size}" for size in SIZES), "ms to start", "MB", "same result"),
        [
            (name, *(f"{us:.1f}" for us in row["us"]), f"{row['start_ms']:.0f}", f"{row['mb']:.0f}",
             "yes" if row["result"] == rows["numpy"]["result"] else "no")
            for name, row in rows.items()
        ],
    )  # fmt: skip
    if any(row["result"] != rows["numpy"]["result"] for row in rows.values()):
        sys.exit("the results differ")
