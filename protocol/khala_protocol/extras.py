"""Packages that only some commands need, the extras of a distribution: what to say where they are not installed.

    with needs("mcp", source="khala mcp"):
        from mcp.server.mcpserver import MCPServer

This is the one place that says how to install them. The command that it names works for the installation that runs: in
a clone it is uv's, which keeps to uv.lock; elsewhere it names the packages of the extra as the metadata list them,
never a distribution of Khala, which a package index may have from somebody else.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import importlib.util
import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit
from urllib.request import url2pathname

from khala_protocol.errors import NotInstalled

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

FRONT: Final = "khala-sc2"
DISTRIBUTIONS: Final = (FRONT, "khala-sc2-agents")
"""Those that have extras."""

_OWN: Final = "khala_"
_EXTRA: Final = re.compile(r"extra == ['\"]([^'\"]+)['\"]")
_REQUIREMENT: Final = re.compile(r"([A-Za-z0-9._-]+)(?:\[([^\]]*)\])?")


def not_installed(extra: str, package: str, *, source: str) -> NotInstalled:
    """Return the error that names a missing package and the command that installs its extra here."""
    return NotInstalled(f"{package} is not installed; this installs it: {install_command(extra)}", source=source)


@contextlib.contextmanager
def needs(extra: str, *, source: str) -> Iterator[None]:
    """Import packages of an extra inside; `source` is the command, option or module that needs them.

    Raises:
        NotInstalled: one of them is missing, or too old.
    """
    try:
        yield
    except NotInstalled:
        raise
    except ImportError as error:
        package = (error.name or "").partition(".")[0]
        if package.startswith(_OWN) or not package:
            raise  # a mistake of ours
        raise not_installed(extra, package, source=source) from None


def install_command(extra: str) -> str:
    """Return the command that installs an extra into the environment of this process."""
    clone = _clone()
    if clone is not None and Path(sys.prefix).resolve() == clone / ".venv":
        own = clone / ".uv" / "bin" / "uv"
        uv = str(own) if own.exists() and not shutil.which("uv") else "uv"
        return _quote([uv, "sync", "--directory", str(clone), "--frozen", "--inexact", "--extra", extra])
    packages = requirements(extra)
    if importlib.util.find_spec("pip") is None:
        return _quote(["uv", "pip", "install", "--python", sys.executable, *packages])
    return _quote([sys.executable, "-m", "pip", "install", *packages])


def requirements(extra: str, distributions: Sequence[str] = DISTRIBUTIONS) -> list[str]:
    """Return what an extra of these distributions requires of others: `mcp>=2.3`, `httpx[socks]>=0.28`."""
    found: dict[str, None] = {}
    for distribution in distributions:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            for line in importlib.metadata.requires(distribution) or ():
                requirement, _, marker = (part.strip() for part in line.partition(";"))
                if _EXTRA.findall(marker) == [extra]:
                    name = _REQUIREMENT.match(requirement)
                    ours = name is not None and name[1].startswith(FRONT)
                    found |= dict.fromkeys(requirements(extra, [name[1]]) if name and ours else [requirement])
    return list(found)


def _clone() -> Path | None:
    """Return the directory of the clone from which Khala is installed; None if it is installed from packages."""
    for distribution in DISTRIBUTIONS:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            said = importlib.metadata.distribution(distribution).read_text("direct_url.json")
            origin = json.loads(said) if said else {}
            if origin.get("dir_info", {}).get("editable"):
                return Path(url2pathname(urlsplit(origin["url"]).path)).resolve()
    return None


def _quote(words: Sequence[str]) -> str:
    return subprocess.list2cmdline(words) if sys.platform == "win32" else shlex.join(words)
