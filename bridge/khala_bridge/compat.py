"""Make PySC2 4.0.0 importable on today's Python, without lasting changes.

Three things stand between PySC2 4.0.0 (2022) and Python 3.11 or newer:

* its requirement `s2clientprotocol` ships stubs for a protobuf that is gone. The package
  `pys2clientprotocol` installs the same import name for the current protobuf (see the overrides in
  `pyproject.toml`); `protobuf_kind` only checks it;
* `pysc2.lib.features` builds its colour palettes at import, and `pysc2.lib.colors` shuffles them with
  `random.shuffle(palette, function)`. Python 3.11 removed the second parameter, so it is restored
  for the import of these two, and removed again;
* `pysc2.env.sc2_env` imports a renderer, and with it pygame, which greets on stdout, and skvideo, which
  imports the deprecated `scipy.misc` and most of SciPy: two of the three seconds that PySC2 takes. The greeting and the
  warnings are muted for the import only; skvideo is imported when the renderer writes a video, which Khala never does.

The other modules take everything that they use of PySC2 from here, so that the order of imports is right by
construction, also where warnings are errors. It is not an adapter: PySC2 itself stays as it was installed.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import random
import sys
import warnings
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, MutableSequence


def _shuffle(x: MutableSequence[object], random_: Callable[[], float] | None = None) -> None:
    """Shuffle as `random.shuffle` of Python 3.10 does: the same draws in the same order."""
    if random_ is None:
        _SHUFFLE(x)
        return
    for i in reversed(range(1, len(x))):
        j = int(random_() * (i + 1))
        x[i], x[j] = x[j], x[i]


_SHUFFLE = random.shuffle
_VIDEO = "pysc2.lib.video_writer"


@contextlib.contextmanager
def old_shuffle() -> Iterator[None]:
    """Give `random.shuffle` its two-parameter form inside the block."""
    random.shuffle = _shuffle
    try:
        yield
    finally:
        random.shuffle = _SHUFFLE


@contextlib.contextmanager
def quiet_pygame() -> Iterator[None]:
    """Keep pygame, which PySC2 imports for its renderer, from printing a greeting."""
    name = "PYGAME_HIDE_SUPPORT_PROMPT"
    before = os.environ.get(name)
    os.environ[name] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


class _Late(ModuleType):
    """A module that is imported when it is first used."""

    def __getattr__(self, name: str) -> object:
        return getattr(importlib.import_module(self.__name__), name)


@contextlib.contextmanager
def late_video() -> Iterator[None]:
    """Replace the renderer's video module with a stand-in that imports the real one when it is used."""
    stand_in = _Late(_VIDEO)
    sys.modules.setdefault(_VIDEO, stand_in)
    try:
        yield
    finally:
        if sys.modules[_VIDEO] is stand_in:
            del sys.modules[_VIDEO]


def protobuf_kind() -> str:
    """Return the protobuf implementation in use: `upb` is fast, `python` is about 80 times slower."""
    from google.protobuf.internal import api_implementation  # noqa: PLC0415  # only the doctor asks

    return api_implementation.Type()


with old_shuffle(), quiet_pygame(), late_video(), warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import portpicker
    from pysc2 import run_configs
    from pysc2.env import environment, lan_sc2_env, sc2_env
    from pysc2.lib import actions, buffs, features, point, protocol, remote_controller, units, upgrades
    from pysc2.maps import lib as maps

__all__ = [
    "actions",
    "buffs",
    "environment",
    "features",
    "lan_sc2_env",
    "late_video",
    "maps",
    "old_shuffle",
    "point",
    "portpicker",
    "protobuf_kind",
    "protocol",
    "quiet_pygame",
    "remote_controller",
    "run_configs",
    "sc2_env",
    "units",
    "upgrades",
]
