"""Archives that StarCraft II's own tools and common readers can read."""

import io

import mpyq
import pytest

from khala_simulator.process import mpq


@pytest.mark.parametrize("count", [1, 2, 3, 9, 40])
def test_a_foreign_reader_finds_every_member(count: int) -> None:
    members = {f"folder\\{number} of {count}.txt": bytes([number]) * (1 + number * 700) for number in range(count)}
    archive = mpq.pack(members)
    found = mpyq.MPQArchive(io.BytesIO(archive)).extract()
    assert {name.decode(): data for name, data in found.items()} == members


def test_a_member_is_read_back_and_others_are_none() -> None:
    archive = mpq.pack({"a": b"one", "b": b"two"})
    assert (mpq.member(archive, "a"), mpq.member(archive, "B"), mpq.member(archive, "c")) == (b"one", b"two", None)


@pytest.mark.parametrize("data", [b"", b"MPQ\x1a", b"MPQ\x1b" + bytes(8), b"hello" * 9])
def test_what_is_no_archive_says_so(data: bytes) -> None:
    with pytest.raises(mpq.MpqError, match="the archive is damaged: "):
        mpq.member(data, "a")


@pytest.mark.parametrize("cut", [10, 31, 40, 60, 90])
def test_a_cut_archive_breaks_nothing(cut: int) -> None:
    try:
        found = mpq.member(mpq.pack({"a": b"one"})[:cut], "a")
    except mpq.MpqError:
        return
    assert found != b"one"
