"""Fixtures of the bus: where to meet without a port."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.register_assert_rewrite("protocol.bus.testing")


@pytest.fixture
def socket() -> Iterator[str]:
    """An endpoint of its own. Not below `tmp_path`, as the path of a unix socket has at most 107 bytes."""
    directory = Path(tempfile.mkdtemp(prefix="bus"))
    yield f"unixsock-stream/{directory}/bus.sock"
    shutil.rmtree(directory)
