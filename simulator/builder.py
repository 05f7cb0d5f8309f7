"""How the simulator is built: by setuptools, with a C compiler from the package index where the machine has none."""

from __future__ import annotations

import os
import shutil
import sys
import sysconfig
from typing import TYPE_CHECKING, Any

from setuptools import build_meta
from setuptools.build_meta import (  # noqa: F401  # what pip and uv ask a backend for
    build_editable,
    build_sdist,
    build_wheel,
    get_requires_for_build_sdist,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

COMPILER = "ziglang>=0.14"
"""A package that carries a C compiler for Linux, macOS and Windows."""


def has_compiler() -> bool:
    """Return whether this machine has a C compiler that setuptools finds."""
    if sys.platform == "win32":
        from setuptools import msvc  # noqa: PLC0415  # there is none elsewhere

        try:
            return bool(msvc.msvc14_get_vc_env("x64"))
        except Exception:  # noqa: BLE001  # it has an exception of its own for each way of not finding it
            return False
    command = os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc"
    return shutil.which(command.split()[0]) is not None


def _compiler() -> list[str]:
    return [] if os.environ.get("KHALA_ENGINE") == "python" or has_compiler() else [COMPILER]


def get_requires_for_build_wheel(config_settings: Mapping[str, Any] | None = None) -> list[str]:
    """Return what a build needs: a compiler as well, where there is none."""
    return [*build_meta.get_requires_for_build_wheel(config_settings), *_compiler()]


def get_requires_for_build_editable(config_settings: Mapping[str, Any] | None = None) -> list[str]:
    """Return what an editable build needs: a compiler as well, where there is none."""
    return [*build_meta.get_requires_for_build_editable(config_settings), *_compiler()]
