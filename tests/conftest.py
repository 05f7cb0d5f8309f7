"""A clock that jumps, for every test that waits; how long a test may take, and how many examples it tries."""

from __future__ import annotations

import asyncio
import gc
import importlib
import selectors
import sys
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

LONG_S = 600.0
"""What a long test may take unless it says otherwise: several times what it takes, for slow machines."""

NEEDS: Mapping[str, tuple[str, ...]] = {"linux": (), "win32": ("posix", "linux"), "other": ("linux",)}
"""Marks of tests that a platform cannot run."""

# No deadlines: a busy machine is no fault of what is tested.
settings.register_profile("short", max_examples=30, deadline=None)
settings.register_profile("long", max_examples=300, deadline=None)  # of `make slow`
settings.load_profile("short")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    many_examples = settings.get_current_profile_name() == "long"
    for item in items:
        if (many_examples or item.get_closest_marker("slow")) and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(LONG_S))
        for name in NEEDS.get(sys.platform, NEEDS["other"]):
            if item.get_closest_marker(name):
                item.add_marker(pytest.mark.skip(reason=f"needs what {name} has"))


def pytest_collection_finish() -> None:
    """Leave the 400 000 objects of the tests themselves out of every later garbage collection: 0.25 s each."""
    _freeze()


def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Leave out what a module has imported as well: every match in this process begins with a collection."""
    if nextitem is not None and nextitem.path != item.path:
        _freeze()


def _freeze() -> None:
    gc.collect()
    gc.freeze()
    gc.collect()  # a full collection waits until a quarter of what the last one saw is new: now that is next to nothing


@pytest.fixture(autouse=True)
def nothing_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trust no code, and forget what a test trusts."""
    monkeypatch.setenv("KHALA_TRUST", "")


@pytest.fixture
def own_sections(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget the sections of observations that a test registers."""
    page = importlib.import_module("khala_bridge.observe.text.page")
    monkeypatch.setattr(page, "SECTIONS", dict(page.SECTIONS))


class _JumpingSelector(selectors.DefaultSelector):
    """Never waits: where a loop would, the clock jumps ahead. Only threads are waited for, for real."""

    def __init__(self) -> None:
        super().__init__()
        self.now_s = 0.0

    def select(self, timeout: float | None = None) -> list[Any]:
        ready = super().select(0)
        if ready or timeout == 0:
            return list(ready)
        if timeout is None:
            ready = super().select(5.0)
            assert ready, "nothing is going on that could ever end this wait"
            return list(ready)
        self.now_s += timeout
        return []


class JumpingLoop(asyncio.SelectorEventLoop):
    def __init__(self) -> None:
        self._jumping = _JumpingSelector()
        super().__init__(self._jumping)

    def time(self) -> float:
        return self._jumping.now_s


def pytest_asyncio_loop_factories(
    config: pytest.Config, item: pytest.Item
) -> Mapping[str, Callable[[], asyncio.AbstractEventLoop]]:
    """Modules that say `CLOCK = "jumps"` get a clock that starts at 0 and never makes anybody wait."""
    jumps = getattr(item.getparent(pytest.Module).obj, "CLOCK", "real") == "jumps"  # type: ignore[union-attr]  # in one
    return {"jumps": JumpingLoop} if jumps else {"real": asyncio.new_event_loop}
