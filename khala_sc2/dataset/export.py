"""Recordings → a data set: find the files, read their rows, choose, write, and say what is in it."""

from __future__ import annotations

import dataclasses
import hashlib
import logging
from typing import TYPE_CHECKING

from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.files import replacing_directory, write_private
from khala_protocol.keys import Topic
from khala_protocol.recording import Recording
from khala_sc2.dataset.card import NAME, Contents, card
from khala_sc2.dataset.dynamics import Transitions
from khala_sc2.dataset.files import Files
from khala_sc2.dataset.lengths import Lengths, token_counter
from khala_sc2.dataset.read import check_splits
from khala_sc2.dataset.repeats import chat_digest, find_shared_prompts
from khala_sc2.dataset.rows import Rows

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from khala_sc2.dataset.card import Recipe
    from khala_sc2.dataset.row import Row

log = logging.getLogger(__name__)

DUPLICATE = "duplicate"
"""Why a row is left out whose prompt and reply came before."""
LOST = ".lost-"
"""In the name of a recording that a whole one stands beside, see `khala_sc2.playing.hosting`."""


def export(sources: Sequence[Path], out: Path, recipe: Recipe) -> Contents:
    """Write a data set, and return what is in it.

    Args:
        sources: recordings, and directories in which they are searched for.
        out: the directory, which must not exist yet or be empty.
        recipe: which rows, in which forms.

    Raises:
        ConfigError: there is no recording, no row, or something in the way.
        RecordingError: a named file is no recording.
    """
    _require_empty(out)
    contents = Contents(lengths=Lengths(token_counter(recipe.tokenizer)))
    recordings = list(_open_each(sources, contents))
    shared = _shared_prompts(recordings, recipe)
    contents.shared = len(shared)
    try:
        with replacing_directory(out) as part:
            shown = _has_pictures(recordings, recipe)
            with Files(part, recipe.formats, images=shown, dynamics=recipe.horizon_s is not None) as files:
                for row in _new_rows(recordings, recipe, contents):
                    own = recipe.split.part(row)
                    split = shared.get(chat_digest(row.prompt), own)
                    contents.moved += split != own
                    files.write(split, row)
                    contents.add(split, row)
            if not contents.rows:
                raise ConfigError(_nothing(contents), source="--only" if recipe.choice.only else None)
            if len(recipe.split.names) > 1:
                check_splits(part, recipe.formats)
            for form in recipe.formats:
                write_private(part / form / NAME, card(contents, recipe, form, _fingerprint(part / form)))
    except OSError as error:
        raise ConfigError(f"cannot be written, and nothing of it is kept: {error.strerror}", source=str(out)) from None
    return contents


def _shared_prompts(recordings: Sequence[Recording], recipe: Recipe) -> Mapping[bytes, str]:
    """Read all rows, and return the split of each prompt that several splits would have."""
    if len(recipe.split.names) == 1:
        return {}
    without_pictures = dataclasses.replace(recipe, images=False)
    rows = (row for recording in recordings for row in _rows(recording, without_pictures, Contents()))
    return find_shared_prompts(rows, recipe.split)


def _new_rows(recordings: Sequence[Recording], recipe: Recipe, contents: Contents) -> Iterator[Row]:
    """Yield the rows of all recordings, without duplicates if the recipe says so."""
    for recording in recordings:
        for row in _rows(recording, recipe, contents):
            if contents.repeats.add(row) and recipe.dedupe:
                contents.left_out[DUPLICATE] += 1
            else:
                yield row


def _fingerprint(directory: Path) -> str:
    """Return a hash of the files of a directory."""
    digest = hashlib.sha256()
    for path in sorted(directory.glob("*.*")):
        with path.open("rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()[:16]


def _rows(recording: Recording, recipe: Recipe, contents: Contents) -> Iterator[Row]:
    """Yield the rows of a recording that pass the filters; count the other decisions."""
    assert recording.run is not None
    rows = (
        Rows(recording, recording.run, gamma=recipe.gamma, images=recipe.images, detail=recipe.detail)
        if recipe.horizon_s is None
        else Transitions(recording, recording.run, horizon_s=recipe.horizon_s, detail=recipe.detail)
    )
    for row in rows:
        if why := recipe.choice.why_not(row):
            contents.left_out[why] += 1
        else:
            yield row if recipe.example == "weighted" else row.without_example()
    contents.left_out += rows.left_out


def _open_each(sources: Sequence[Path], contents: Contents) -> Iterator[Recording]:
    seen: set[Path] = set()
    for source in sources:
        for path in _found(source):
            if path.resolve() in seen:
                continue
            seen.add(path.resolve())
            recording = _recording(path, named=path == source)
            if recording is None:
                contents.unread += 1
            else:
                contents.recordings += 1
                yield recording


def _found(source: Path) -> Sequence[Path]:
    if not source.is_dir():
        return [source]
    found = sorted(path for path in source.rglob("*.mcap") if LOST not in path.name)
    if not found:
        raise ConfigError("holds no recordings (*.mcap)", source=str(source))
    return found


def _recording(path: Path, *, named: bool) -> Recording | None:
    """Return a recording of a match; None for one that was found in a directory and is none.

    Raises:
        RecordingError: it was named, and is none.
    """
    try:
        return _match(path)
    except RecordingError as error:
        if named:
            raise
        log.warning("%s; it is left out", error)
        return None


def _match(path: Path) -> Recording:
    recording = Recording.open(path)
    if recording.run is None:
        raise RecordingError(f"{path} has no run card: the run ended before the match began")
    return recording


def _has_pictures(recordings: Sequence[Recording], recipe: Recipe) -> bool:
    """Return whether the data set has pictures: a column has one type, in rows without any, too."""
    keys = (key for recording in recordings for key in recording.counts)
    return recipe.images and recipe.horizon_s is None and any(f"/{Topic.IMAGE}/" in key for key in keys)


def _require_empty(out: Path) -> None:
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError("exists already, and is not empty: name another directory", source=str(out))


def _nothing(contents: Contents) -> str:
    left_out = ", ".join(f"{reason}: {count}" for reason, count in sorted(contents.left_out.items()) if count)
    return f"no decision is left to export ({left_out or 'the recordings hold none'})"
