"""Compile the rules of the engine; ``builder`` brings a C compiler along where the machine has none.

A rule is compiled if a file of its name with the suffix ``.pxd`` stands beside it. ``KHALA_ENGINE=compiled`` in the
environment makes a failed build an error, ``KHALA_ENGINE=python`` builds nothing.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

from setuptools import Extension, setup

sys.path.insert(0, str(Path(__file__).parent))

from builder import has_compiler

from khala_simulator.native import declare, flags

ENGINE = os.environ.get("KHALA_ENGINE") or "auto"
PACKAGE = Path("khala_simulator")


def find_compiler() -> bool:
    """Return whether there is a C compiler, and let setuptools use the one that came along if there is no other."""
    if has_compiler():
        return True
    if importlib.util.find_spec("ziglang") is None:
        return False
    command = f"{sys.executable} -m ziglang cc"
    os.environ["CC"] = os.environ["CXX"] = command
    os.environ["LDSHARED"] = f"{command} -shared" + (" -undefined dynamic_lookup" if sys.platform == "darwin" else "")
    return True


def members() -> list[Path]:
    """Return the files to be compiled: kernels, and rules that have a ``.pxd``."""
    kernels = set(PACKAGE.rglob("*.pyx"))
    rules = {types.with_suffix(".py") for types in PACKAGE.rglob("*.pxd")}
    taken = {kernel.with_suffix(".py") for kernel in kernels}
    return sorted(kernels | {rule for rule in rules - taken if rule.exists()})


def layouts_changed() -> bool:
    """Return whether a ``.pxd`` is younger than what was compiled: Cython does not see all who use it."""
    compiled = [made.stat().st_mtime for made in PACKAGE.rglob("*.c")]
    return bool(compiled) and max(types.stat().st_mtime for types in PACKAGE.rglob("*.pxd")) > min(compiled)


def extensions() -> list[Extension]:
    """Return the modules to be compiled: none without a compiler."""
    if ENGINE == "python" or not find_compiler():
        sys.stderr.write("khala-sc2-simulator: no C compiler, so the interpreter plays the rules, slowly\n")
        return []
    import numpy as np  # noqa: PLC0415  # only what compiles needs these two
    from Cython.Build import cythonize  # noqa: PLC0415

    declare.write()
    modules = [
        Extension(
            ".".join(member.with_suffix("").parts),
            [str(member)],
            include_dirs=[np.get_include()],
            define_macros=[("NPY_NO_DEPRECATED_API", "NPY_1_7_API_VERSION")],
            extra_compile_args=list(flags.COMPILER),
            optional=ENGINE != "compiled",
        )
        for member in members()
    ]
    jobs = os.cpu_count() or 1
    threads = jobs if sys.platform == "linux" else 0
    return list(cythonize(modules, compiler_directives=flags.CYTHON, nthreads=threads, force=layouts_changed()))


setup(ext_modules=extensions(), options={"build_ext": {"parallel": os.cpu_count() or 1}})
