"""A game whose client was killed ends by itself, and no other does."""

import asyncio
from collections.abc import Callable, Iterable

import pytest

from khala_simulator.process.parent_watch import PATIENCE_LOOKS, wait_until_orphaned

ALONE = PATIENCE_LOOKS


async def looks_until_over(parents: Iterable[int], clients: Iterable[bool]) -> int | None:
    """Return after how many looks the game ends; None if it goes on after all of them."""
    looked = 0
    parent_ids, connected = iter(parents), iter(clients)
    forever = asyncio.get_running_loop().create_future()

    def parent() -> int:
        nonlocal looked
        looked += 1
        found = next(parent_ids, None)
        if found is None:
            forever.set_result(None)
            raise asyncio.CancelledError
        return found

    has_client: Callable[[], bool] = lambda: next(connected)  # noqa: E731
    try:
        await wait_until_orphaned(has_client, parent=parent, look_s=0)
    except asyncio.CancelledError:
        assert forever.done()
        return None
    return looked - 1  # the first is at birth


@pytest.mark.parametrize(
    ("parents", "clients", "looks"),
    [
        ([7] * 50, [False] * 50, None),
        ([7] + [1] * 50, [True] * 50, None),
        ([7, 7, 7] + [1] * 50, [False] * 50, 2 + ALONE),
        ([7] + [1] * 50, [False] * 5 + [True] + [False] * 50, 6 + ALONE),
        ([1] * 50, [False] * 50, None),
    ],
    ids=["parent lives", "client is there", "parent dies", "client comes back", "started by init"],
)
async def test_when_a_game_is_over(parents: list[int], clients: list[bool], looks: int | None) -> None:
    assert await looks_until_over(parents, clients) == looks
