"""What a view was asked to open: recordings and experiments, by the ids under which the page asks for them.

An id is a hash of a path that was found here: no path of a request ever names a file.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from khala_orchestrator.past.places import place_of
from khala_protocol.errors import ConfigError
from khala_sc2.view import experiments, library
from khala_sc2.view.library import run_id
from khala_sc2.view.runs import NotThere, Opened
from khala_sc2.view.wire import ExperimentView, Library

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


class Sources:
    """The recordings and experiments of one view.

    Args:
        title: what was asked for.
        directory: whose recordings are listed; None lists only those that are opened.
        opened: recordings with which the page begins.
        adviser: name of the adviser as which the page writes; "" for none.
    """

    def __init__(self, title: str, directory: Path | None, opened: Sequence[Path] = (), *, adviser: str = "") -> None:
        self.title = title
        self._directory = directory
        self._first = tuple(opened)
        self._adviser = adviser
        self._recordings = {run_id(path): path for path in opened}
        self._experiments: dict[str, Path] = {}

    def library(self) -> Library:
        """Return what can be opened."""
        found = library.found_in(self._directory) if self._directory else library.FoundRecordings([], [])
        paths = list(dict.fromkeys((*self._first, *found.recordings)))
        self._recordings |= {run_id(path): path for path in paths}
        self._experiments |= {run_id(path): path for path in found.experiments}
        return Library(
            title=self.title,
            runs=tuple(library.lines(paths, self._directory or Path())),
            experiments=tuple(experiments.list_experiments(found.experiments)),
            opened=tuple(run_id(path) for path in self._first),
        )

    def open(self, id: str, changed: Callable[[], None] = lambda: None) -> Opened:  # noqa: A002  # as in the paths
        """Return a recording.

        Raises:
            NotThere: there is none of this id.
            RecordingError: it cannot be read.
        """
        if id not in self._recordings:
            self.library()
        if (path := self._recordings.get(id)) is None:
            raise NotThere("there is no such recording here")
        return Opened(id, path, library.shown(path, self._directory), changed=changed, adviser=self._adviser)

    def experiment(self, id: str) -> ExperimentView:  # noqa: A002  # as in the paths
        """Return the table of an experiment.

        Raises:
            NotThere: there is none of this id.
            KhalaError: it cannot be read, or no match of it was played.
        """
        if id not in self._experiments:
            self.library()
        if (path := self._experiments.get(id)) is None:
            raise NotThere("there is no such experiment here")
        from khala_sc2.view.table import experiment_view  # noqa: PLC0415  # SciPy takes a second

        return experiment_view(path, self._directory or path)


def find(given: Sequence[str], runs: Path, *, adviser: str = "") -> Sources:
    """Return what names on the command line stand for: recordings, directories, runs below `runs`.

    Raises:
        ConfigError: there is no such thing, or too many.
    """
    if len(given) > 2:
        raise ConfigError(f"at most two can be seen side by side, and these are {len(given)}: name one or two")
    if not given:
        if not runs.is_dir():
            raise ConfigError(
                f"there is no directory {runs}: name a recording or a directory, or play with `khala run`"
            )
        return Sources(str(runs), runs, adviser=adviser)
    places = [_place(name, runs) for name in given]
    directories = [place for place in places if place.is_dir()]
    if directories and len(places) > 1:
        raise ConfigError(
            f"{directories[0]} does not hold exactly one recording: name two recordings to see them side by side"
        )
    if directories:
        return Sources(given[0], directories[0], adviser=adviser)
    return Sources(" and ".join(given), None, places, adviser=adviser)


def _place(name: str, runs: Path) -> Path:
    """Return the recording or the directory that a name stands for; of a run with one recording, that."""
    path = place_of(Path(name), runs)
    if path.is_dir():
        found = library.found_in(path)
        return found.recordings[0] if len(found.recordings) == 1 and not found.experiments else path
    library.read_head(path)  # says at once what is no recording
    return path
