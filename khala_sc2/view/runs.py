"""A recording that was opened: its index, the thread that keeps that up to date, and every answer of its paths.

Answers are bytes of JSON, made in threads: `khala_sc2.view.server` sends them, `khala_sc2.view.export` keeps them in a file.
"""

from __future__ import annotations

import contextlib
from functools import cached_property
from typing import TYPE_CHECKING, Literal, TypeVar

from khala_protocol.codec import decode_as
from khala_protocol.errors import PeerError
from khala_protocol.keys import Topic
from khala_protocol.messages import LOOPS_PER_S, Briefing, Result, Run, Wire
from khala_sc2.view import scenes, terrain
from khala_sc2.view.index import Index, Spot
from khala_sc2.view.library import PLAYERS, line_of, read_head
from khala_sc2.view.moments import Moments
from khala_sc2.view.scan import Scanning
from khala_sc2.view.timeline import timeline
from khala_sc2.view.wire import MOST_SCENES, AgentLine, EpisodeLine, RecordingProgress, RunView, Scenes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from khala_sc2.view.wire import RunLine

W = TypeVar("W", bound=Wire)


_PICTURES = {b"\xff\xd8\xff": "image/jpeg", b"\x89PNG\r\n\x1a\n": "image/png", b"RIFF": "image/webp"}
"""Media types by how the bytes begin; nothing else is sent as a picture."""


class NotThere(LookupError):
    """There is no such episode, step, agent or picture; the text says which."""


class Opened:
    """One recording, for as long as it is looked at.

    Args:
        id: its name in paths.
        path: of the recording.
        shown: its path as it is shown.
        changed: is called in another thread when there is more in the index.
        adviser: name of the adviser as which the page writes to agents; "" for none.
    """

    def __init__(
        self,
        id: str,  # noqa: A002  # as in the paths
        path: Path,
        shown: str = "",
        *,
        changed: Callable[[], None] = lambda: None,
        adviser: str = "",
    ) -> None:
        self.id = id
        self.path = path
        self.shown = shown or path.name
        self._adviser = adviser
        self.index = Index(path)
        self.scanning = Scanning(self.index, changed)
        self._scales: dict[int, float] = {}
        self._timelines: dict[int, tuple[int, bytes]] = {}
        """By episode, with the offset of the index at which it was made."""
        self._known: tuple[int, tuple[AgentLine, ...]] = (-1, ())
        """The agents as they were known at an offset of the index."""

    def start(self) -> None:
        """Begin to index."""
        self.scanning.start()

    def close(self) -> None:
        """End the thread, and close the index."""
        self.scanning.stop()
        self.index.close()

    # --- answers ------------------------------------------------------------------------------------

    def view(self) -> bytes:
        """Return the `RunView`."""
        card = self._card
        line = self.line()
        return RunView(
            line=line,
            sides=self.sides,
            agents=self.agents(),
            episodes=tuple(self.episodes()),
            indexed=self.indexed_share(),
            scenes=self._drawn_from(),
            can_advise=line.live and self.may_advise,
            card=card.model_dump(mode="json") if card else {},
        ).model_dump_json().encode()  # fmt: skip

    def timeline(self, episode: int) -> bytes:
        """Return the `Timeline` of an episode."""
        self._require(episode)
        offset = self.index.meta("offset", 0)
        if self._timelines.get(episode, (-1, b""))[0] != offset:
            self._timelines[episode] = offset, timeline(self.index, episode).model_dump_json().encode()
        return self._timelines[episode][1]

    def terrain(self, episode: int) -> bytes:
        """Return the `Terrain` of an episode."""
        self._require(episode)
        if (spot := terrain.find(self.index, episode)) is not None:
            return self.index.payload(spot)
        return terrain.from_views(self.index, self.run, episode).model_dump_json().encode()

    def scenes(self, episode: int, first: int, last: int) -> bytes:
        """Return the `Scenes` from step to step, both included."""
        self._require(episode)
        last = min(last, first + MOST_SCENES - 1)
        if self._drawn_from() != "views":
            return scenes.recorded_scenes(self.index, episode, first, last)
        found = scenes.from_views(self.index, self.run, self.sides, episode, first, last, self._scale(episode))
        return Scenes(scenes=tuple(found)).model_dump_json().encode()

    def moment(self, episode: int, step: int) -> bytes:
        """Return the `Moment` of a step."""
        found = self._moments(episode).moment(episode, step)
        if found is None:
            raise NotThere(f"episode {episode} has no step {step} yet")
        return found.model_dump_json().encode()

    def texts(self, episode: int, step: int, side: str, agent: str) -> bytes:
        """Return what an agent was `Asked`."""
        found = self._moments(episode).texts(episode, step, side, agent)
        if found is None:
            raise NotThere(f"{side}/{agent} was not asked up to step {step} of episode {episode}")
        return found.model_dump_json().encode()

    def picture(self, sha256: str) -> tuple[str, bytes]:
        """Return the media type of a picture, and its bytes."""
        found = self.index.rows("select chunk, place from image where sha256 = ?", sha256)
        data = self.index.payload(Spot(*found[0])) if found else b""
        kind = next((kind for magic, kind in _PICTURES.items() if data.startswith(magic)), None)
        if kind is None:
            raise NotThere("there is no such picture in this recording")
        return kind, data

    def progress(self) -> RecordingProgress:
        """Return how far the match, and the index, are."""
        newest = self.index.rows("select episode, count(*) from step group by episode order by episode desc limit 1")
        episode, steps = newest[0] if newest else (0, 0)
        live = read_head(self.path).live
        lag_s = self.index.meta("lag_s") if live else None
        return RecordingProgress(episode=episode, steps=steps, indexed=self.indexed_share(), live=live, lag_s=lag_s)

    @property
    def may_advise(self) -> bool:
        """Whether the task takes advice from this view's adviser."""
        return self._card is not None and bool(self._adviser) and self._adviser in self._card.advisers

    @property
    def run(self) -> str:
        """Name of the run."""
        return self._card.run if self._card else self.id

    # --- parts --------------------------------------------------------------------------------------

    def indexed_share(self) -> float:
        """Return the part of the recording that is indexed; of one that is torn or grows, of what is whole of it."""
        if self.index.meta("ended") or self.index.meta("broken"):
            return 1.0
        with contextlib.suppress(OSError):
            size = max(1, self.path.stat().st_size)
            if self.index.meta("caught_up") == size:
                return 1.0
            offset: int = self.index.meta("offset", 0)
            return min(0.9999, round(offset / size, 4))
        return 0.0

    def line(self) -> RunLine:
        """Return the recording as a list shows it."""
        found = line_of(read_head(self.path), self.id, self.shown)
        models = tuple(dict.fromkeys(name for (name,) in self.index.rows("select name from model order by name")))
        episodes = list(self.episodes())
        outcomes = {
            side: tuple(episode.outcomes[side] for episode in episodes if side in episode.outcomes)
            for side in self.sides
        }  # fmt: skip
        return found.but(
            models=models or found.models,
            outcomes={side: those for side, those in outcomes.items() if those},
            episodes=max(len(episodes), found.episodes),
            steps=sum(episode.steps for episode in episodes),
            game_s=sum(episode.game_s for episode in episodes),
        )

    def agents(self) -> tuple[AgentLine, ...]:
        """Return the agents of the match."""
        offset = self.index.meta("offset", 0)
        if self._known[0] != offset:
            self._known = offset, tuple(self._agents())
        return self._known[1]

    def _agents(self) -> Iterator[AgentLine]:
        names = {(side, agent): name for side, agent, name in self.index.rows("select * from model")}
        card = self._card
        labels = card.labels if card else {}
        player = next((labels[name] for name in PLAYERS if name in labels), "")
        for agent in card.agents if card else ():
            found = self.index.rows(
                "select chunk, place from sample where topic = ? and side = ? and agent = ? "
                "order by rowid desc limit 1", Topic.BRIEFING, agent.side, agent.name,
            )  # fmt: skip
            briefing = self._read(Briefing, Spot(*found[0]) if found else None)
            yield AgentLine(
                side=agent.side,
                name=agent.name,
                kind=briefing.agent_kind if briefing else "combat_group",
                model=names.get((agent.side, agent.name), player),
                teams=agent.teams,
                role=briefing.role if briefing else "",
            )

    def episodes(self) -> Iterator[EpisodeLine]:
        """Yield the episodes so far."""
        results: dict[int, list[Result]] = {}
        for found in self.index.rows("select episode, chunk, place from sample where topic = ?", Topic.RESULT):
            if (result := self._read(Result, Spot(*found[1:]))) is not None:
                results.setdefault(found[0], []).append(result)
        counts = self.index.rows(
            "select episode, count(*), max(step), max(json_extract(data, '$.after')) from step group by episode"
        )
        for episode, steps, _, loop in counts:
            ended = results.get(episode, [])
            yield EpisodeLine(
                episode=episode,
                steps=steps,
                game_s=ended[0].game_s if ended else round((loop or 0) / LOOPS_PER_S, 2),
                wall_s=ended[0].wall_s if ended else None,
                outcomes={result.side: result.outcome for result in ended},
                causes={result.side: result.cause for result in ended},
                kd={result.side: result.kd for result in ended},
                invalid_because=next((result.invalid_because for result in ended if not result.valid), ""),
            )

    @property
    def sides(self) -> tuple[str, ...]:
        """The sides that Khala plays."""
        return tuple(dict.fromkeys(agent.side for agent in self._card.agents)) if self._card else ()

    @cached_property
    def _card(self) -> Run | None:
        return read_head(self.path).card

    def _require(self, episode: int) -> None:
        if not self.index.rows("select 1 from step where episode = ? limit 1", episode):
            raise NotThere(f"this recording has no episode {episode} yet")

    def _drawn_from(self) -> Literal["whole", "seen", "views"]:
        found: Literal["whole", "seen", "views"] = self.index.meta("scenes", "views")
        return found

    def _scale(self, episode: int) -> float:
        if (known := self._scales.get(episode)) is not None:
            return known
        scale = terrain.scale_of(self.index, episode)
        if self.indexed_share() >= 1.0:
            self._scales[episode] = scale
        return scale

    def _moments(self, episode: int) -> Moments:
        return Moments(self.index, self.agents(), self._scale(episode))

    def _read(self, kind: type[W], spot: Spot | None) -> W | None:
        try:
            return decode_as(kind, self.index.payload(spot)) if spot else None
        except PeerError:
            return None
