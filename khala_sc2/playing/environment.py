"""What the processes of a match find in their environment: what they need, and no key that is not theirs.

An agent with a model gets the variables that the model's file names. The game gets neither keys nor
proxies. A policy is code of the user, which may read anything, so its process gets all (see `khala_sc2.playing.local`).
"""

from __future__ import annotations

import fnmatch
import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_agents.config import ModelConfig

PLAIN = (
    "PATH", "HOME", "USER", "LOGNAME", "SHELL", "PWD", "TMPDIR", "TEMP", "TMP", "TZ", "LANG", "LANGUAGE", "LC_*",
    "PYTHON*", "VIRTUAL_ENV", "CONDA_PREFIX", "COVERAGE_*", "XDG_*", "KHALA_CACHE",
    "TERM", "COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR",
    "LD_LIBRARY_PATH", "LD_PRELOAD", "DYLD_*", "MALLOC_*", "OMP_*", "OPENBLAS_*", "RUST_LOG", "RUST_BACKTRACE",
    "DISPLAY", "WAYLAND_DISPLAY", "XAUTHORITY", "CUDA_*", "NVIDIA_*", "EGL_*", "MESA_*", "LIBGL_*", "__GL*", "__EGL*",
    "SYSTEMROOT", "SYSTEMDRIVE", "WINDIR", "COMSPEC", "PATHEXT", "USERPROFILE", "APPDATA", "LOCALAPPDATA",
    "PROGRAMDATA", "PROGRAMFILES*", "NUMBER_OF_PROCESSORS", "PROCESSOR_*",
)  # fmt: skip
"""Names of what any process may need, a game that draws included."""
NETWORK = (
    "*_PROXY", "*_proxy", "SSL_CERT_FILE", "SSL_CERT_DIR", "SSLKEYLOGFILE", "REQUESTS_CA_BUNDLE", "CURL_CA_BUNDLE",
)  # fmt: skip
"""Names of what a client of a model needs as well; a proxy's address may hold a password."""


def plain(environ: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return the environment of a process that needs no key."""
    return _only(environ, *PLAIN)


def with_model(model: ModelConfig, environ: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return the environment of an agent with this model: with the variables that the model's file names."""
    return _only(environ, *PLAIN, *NETWORK, *model.variables)


def _only(environ: Mapping[str, str], *patterns: str) -> dict[str, str]:
    return {name: value for name, value in environ.items() if any(fnmatch.fnmatchcase(name, p) for p in patterns)}
