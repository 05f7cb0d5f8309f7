"""What a view was asked to open: recordings by their ids, and experiments."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from khala.view import library
from khala.view.runs import NotThere, Opened
from khala.view.wire import ExperimentView, Library
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence


class Sources:
    """The recordings and experiments of one view.

    Args:
        title: what was asked for.
        directory: whose recordings are listed; None lists only those that are opened.
        opened: recordings with which the page begins.
        can_advise: whether the view may write to agents.
    """

    def __init__(
        self, title: str, directory: Path | None, opened: Sequence[Path] = (), *, can_advise: bool = False
    ) -> None:
        self._title, self._directory, self._first = title, directory, tuple(opened)
        self._can_advise = can_advise
        self._paths = library.by_id(opened)

    def library(self) -> Library:
        """Return what can be opened."""
        paths = list(self._listed())
        self._paths |= library.by_id(paths)
        return Library(
            title=self._title,
            runs=tuple(library.lines(paths, self._directory or Path())),
            opened=tuple(library.run_id(path) for path in self._first),
        )

    def open(self, id: str, changed: Callable[[], None]) -> Opened:  # noqa: A002  # as in the paths
        """Return a recording by its id.

        Raises:
            NotThere: there is none.
            RecordingError: it cannot be read.
        """
        if id not in self._paths:
            self.library()
        if (path := self._paths.get(id)) is None:
            raise NotThere("there is no such recording here")
        return Opened(id, path, changed=changed, can_advise=self._can_advise)

    def experiment(self, id: str) -> ExperimentView:  # noqa: A002  # as in the paths
        """Return the table of an experiment.

        Raises:
            NotThere: there is none.
        """
        raise NotThere(f"there is no experiment {id!r} here")

    def _listed(self) -> Iterable[Path]:
        below = library.recordings(self._directory) if self._directory else []
        return dict.fromkeys((*self._first, *below))


def find(given: Sequence[str], runs: Path) -> Sources:
    """Return what names on the command line stand for: recordings, directories, runs below `runs`.

    Raises:
        ConfigError: there is no such thing, or too many.
    """
    if len(given) > 2:
        raise ConfigError(f"at most two can be seen side by side, and these are {len(given)}: name one or two")
    if not given:
        if not runs.is_dir():
            raise ConfigError(f"there is no directory {runs}: name a recording or a directory, or play with `khala run`")
        return Sources(str(runs), runs)
    places = [_place(name, runs) for name in given]
    directories = [place for place in places if place.is_dir()]
    if directories and len(places) > 1:
        raise ConfigError(f"{directories[0]} holds several recordings: name two recordings to see them side by side")
    if directories:
        return Sources(given[0], directories[0])
    return Sources(" and ".join(given), None, places)


def _place(name: str, runs: Path) -> Path:
    """Return the recording or the directory that a name stands for; of a run with one recording, that."""
    path = next((path for path in (Path(name), runs / name) if path.exists()), None)
    if path is None:
        raise ConfigError(f"there is no {name}, nor {runs / name}: name a recording, a directory or a run")
    if path.is_dir() and len(found := library.recordings(path)) == 1:
        return found[0]
    return path
