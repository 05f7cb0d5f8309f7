"""Compile the rules of the engine, where there is a C compiler; without one the interpreter plays them.

A rule is compiled if a file of its name with the suffix ``.pxd`` stands beside it.

``KHALA_ENGINE=compiled`` in the environment makes a failed build an error, ``KHALA_ENGINE=python`` builds nothing.
"""

from __future__ import annotations

import os
import shutil
import sys
import sysconfig
from pathlib import Path

from setuptools import Extension, setup

ENGINE = os.environ.get("KHALA_ENGINE") or "auto"
PACKAGE = Path("khala_simulator")
# Products and sums are rounded one by one, as numpy does, and square roots set no errno.
FLAGS = ["/O2"] if sys.platform == "win32" else ["-O2", "-g0", "-ffp-contract=off", "-fno-math-errno", "-w"]
DIRECTIVES = {
    "language_level": 3,
    "boundscheck": True,  # of lists and tuples; memory is read by pointers, which nothing checks
    "wraparound": True,
    "cdivision": True,
    "initializedcheck": False,
    "binding": False,
    "embedsignature": False,
    "infer_types": True,
    "annotation_typing": False,  # a rule's annotations are for readers and type checkers; its .pxd has the types of C
}


def compiler() -> str | None:
    """Return the C compiler, or None where there is none."""
    if sys.platform == "win32":
        return "cl"  # setuptools finds Visual Studio by itself; without it the build fails, and that is no error
    return shutil.which((os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc").split()[0])


def members() -> list[Path]:
    """Return the files to be compiled: kernels, and rules that have a ``.pxd``."""
    kernels = set(PACKAGE.rglob("*.pyx"))
    rules = {types.with_suffix(".py") for types in PACKAGE.rglob("*.pxd")}
    taken = {kernel.with_suffix(".py") for kernel in kernels}
    return sorted(kernels | {rule for rule in rules - taken if rule.exists()})


def extensions() -> list[Extension]:
    """Return the modules to be compiled: none without a compiler."""
    if ENGINE == "python" or not (compiler() or ENGINE == "compiled"):
        sys.stderr.write("khala-simulator: no C compiler, so the engine is built without compiled systems\n")
        return []
    import numpy as np  # noqa: PLC0415  # only what compiles needs these two
    from Cython.Build import cythonize  # noqa: PLC0415

    sys.path.insert(0, str(Path.cwd()))
    from khala_simulator.native import declare  # noqa: PLC0415  # it reads the columns of a world


    declare.write()
    modules = [
        Extension(
            ".".join(member.with_suffix("").parts),
            [str(member)],
            include_dirs=[np.get_include()],
            define_macros=[("NPY_NO_DEPRECATED_API", "NPY_1_7_API_VERSION")],
            extra_compile_args=FLAGS,
            optional=ENGINE != "compiled",
        )
        for member in members()
    ]
    jobs = os.cpu_count() or 1
    return list(cythonize(modules, compiler_directives=DIRECTIVES, nthreads=jobs if sys.platform == "linux" else 0))


setup(ext_modules=extensions(), options={"build_ext": {"parallel": os.cpu_count() or 1}})
