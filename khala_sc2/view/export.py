"""A view as one file that opens without a server: the built page, with the answers of one run or two put into it.

The answers are those of the server, by the same paths, packed with gzip in base64; the page unpacks them. Pictures are
in them as data. A policy in the file keeps it from asking anybody for anything.
"""

from __future__ import annotations

import base64
import html
import json
import zlib
from typing import TYPE_CHECKING, Any

from khala_protocol.errors import ConfigError, KhalaError
from khala_protocol.files import MB, write_private
from khala_sc2.view.guard import policy_of
from khala_sc2.view.runs import NotThere
from khala_sc2.view.scan import whole
from khala_sc2.view.wire import SCENES_AT_ONCE

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from khala_orchestrator.past.transcript import StepSelection
    from khala_sc2.view.runs import Opened
    from khala_sc2.view.sources import Sources

MOST_BYTES = 50 * MB
"""Of the file: browsers and mail servers take more badly."""
_HEAD = "<head>"


class TooLarge(ConfigError):
    """The file would be larger than browsers like."""


class _Packer:
    """A JSON object that is packed while it grows."""

    def __init__(self) -> None:
        self._packer = zlib.compressobj(9, zlib.DEFLATED, 31)
        self._parts: list[bytes] = []
        self._size = 0
        self._first = True

    def add(self, path: str, answer: bytes) -> None:
        """Add the answer of a path.

        Raises:
            TooLarge: the file would have more than `MOST_BYTES`.
        """
        before = b"{" if self._first else b","
        self._first = False
        self._put(self._packer.compress(before + json.dumps(path).encode() + b":" + answer))

    def text(self) -> str:
        """Return all of it in base64."""
        self._put(self._packer.compress(b"}") + self._packer.flush())
        return base64.b64encode(b"".join(self._parts)).decode()

    def _put(self, packed: bytes) -> None:
        self._parts.append(packed)
        self._size += len(packed)
        if self._size * 4 / 3 > MOST_BYTES:
            raise TooLarge(
                f"the file would be larger than {MOST_BYTES // MB} MB: choose a part with --steps 0-500, or fewer "
                "agents with --agents"
            )


def export(sources: Sources, page: str, path: Path, *, steps: StepSelection, agents: Collection[str]) -> int:
    """Write the answers of the opened runs into a file with the page, and return its size in bytes.

    Args:
        sources: with one or two runs.
        page: as it was built.
        path: of the file.
        steps: of each episode.
        agents: whose long texts are wanted: names, or `side/name`; all of them if none is named.

    Raises:
        ConfigError: it would be too large, cannot be written, or there is nothing to export.
    """
    library = sources.library()
    if not library.opened:
        raise ConfigError("an export shows one recording or two: name them, `khala view RECORDING --export out.html`")
    packer = _Packer()
    opened = [line for line in library.runs if line.id in library.opened]
    packer.add("library", library.but(runs=tuple(opened), experiments=()).model_dump_json().encode())
    for line in opened:
        run = sources.open(line.id, lambda: None)
        try:
            whole(run.index)
            for name, answer in _answers(run, steps, agents):
                packer.add(f"runs/{run.id}{name}", answer)
        except OSError as error:
            raise ConfigError(f"{run.path} cannot be read: {error.strerror}") from None
        finally:
            run.index.close()
    text = _together(page, packer.text())
    try:
        write_private(path, text)
    except OSError as error:
        raise ConfigError(f"{path} cannot be written: {error.strerror}; choose another place") from None
    return len(text)


def _answers(run: Opened, part: StepSelection, agents: Collection[str]) -> Iterator[tuple[str, bytes]]:
    """Yield the answers of a run that the page may ask for, by their paths below it."""
    view: dict[str, Any] = json.loads(run.view())
    seats = [(agent["side"], agent["name"]) for agent in view["agents"]]
    wanted = {(side, name) for side, name in seats if not agents or {name, f"{side}/{name}"} & {*agents}}
    yield "", json.dumps(view | {"can_advise": False}).encode()
    pictures: set[str] = set()
    for episode in (line["episode"] for line in view["episodes"]):
        begin = f"/episodes/{episode}"
        asked: set[tuple[int, str, str]] = set()
        timeline = run.timeline(episode)
        steps = [step for step in json.loads(timeline)["steps"] if part.holds(step)]
        yield f"{begin}/timeline", timeline
        yield f"{begin}/terrain", run.terrain(episode)
        for start in sorted({step - step % SCENES_AT_ONCE for step in steps}):
            end = start + SCENES_AT_ONCE - 1
            yield f"{begin}/scenes?from={start}&to={end}", run.scenes(episode, start, end)
        for step in steps:
            moment = run.moment(episode, step)
            yield f"{begin}/steps/{step}", moment
            for decision in json.loads(moment)["decisions"]:
                pictures |= {image["sha256"] for image in decision["images"]}
                if (decision["side"], decision["agent"]) in wanted:
                    asked.add((decision["step"], decision["side"], decision["agent"]))
        for step, side, agent in sorted(asked):
            yield f"{begin}/steps/{step}/agents/{side}/{agent}", run.texts(episode, step, side, agent)
    yield from _pictures(run, pictures)


def _pictures(run: Opened, digests: Collection[str]) -> Iterator[tuple[str, bytes]]:
    for digest in sorted(digests):
        try:
            kind, data = run.picture(digest)
        except (NotThere, KhalaError):
            continue
        yield f"/images/{digest}", json.dumps(f"data:{kind};base64,{base64.b64encode(data).decode()}").encode()


def _together(page: str, data: str) -> str:
    """Return the page with its policy and the data, which stand before its script."""
    if _HEAD not in page:
        raise ConfigError("the page of `khala view` is not built: `make page` builds khala_sc2/view/assets/index.html")
    # a policy in the page has no frame-ancestors, and one without a server has nobody to connect to
    rules = [rule for rule in policy_of(page).split("; ") if not rule.startswith("frame-ancestors")]
    policy = "; ".join(rules).replace("connect-src 'self'", "connect-src 'none'")
    tag = f'<meta http-equiv="Content-Security-Policy" content="{html.escape(policy)}">'
    script = f'<script type="application/json" id="khala-data">{data}</script>'
    return page.replace(_HEAD, f"{_HEAD}{tag}{script}", 1)
