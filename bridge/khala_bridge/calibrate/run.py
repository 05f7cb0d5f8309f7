"""Play probes one after another in one process of the game, and keep what each found.

A probe that fails is written down with the reason, and the next one begins in a new game. Above: `khala_sc2.calibrate`.
"""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

from khala_bridge.calibrate.lab import Lab
from khala_bridge.calibrate.record import Calibration, Measured, Values

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_bridge.calibrate.connection import Connection
    from khala_bridge.calibrate.probe import Probe

log = logging.getLogger(__name__)


def play(
    connection: Connection,
    probes: Sequence[Probe],
    begun: Calibration,
    *,
    save: Callable[[Calibration], None],
    watch: Callable[[Probe, Measured | None], None],
) -> Calibration:
    """Play the probes that a calibration does not have yet, and return it with them.

    Args:
        connection: to the game.
        probes: in the order of play.
        begun: which game it is, with the seed, and what was found before.
        save: called after each probe, with all that was found so far.
        watch: called when a probe begins, and with what it found.
    """
    stage = _Stage(connection, begun.seed)
    for probe in probes:
        earlier = begun.probes.get(probe.id)
        if earlier is not None and not earlier.failed:
            continue
        watch(probe, None)
        found = stage.measure(probe)
        begun = begun.with_probe(probe.id, found)
        save(begun)
        watch(probe, found)
    return begun


class _Stage:
    """The game that probes of one setting share."""

    def __init__(self, connection: Connection, seed: int) -> None:
        self._connection = connection
        self._seed = seed
        self._lab: Lab | None = None

    def measure(self, probe: Probe) -> Measured:
        samples: dict[str, list[float]] = {}
        failed = ""
        loops = 0
        begun = time.monotonic()
        try:
            lab = self._ready(probe)
            first = lab.loop
            for name, value in probe.play(lab):
                samples.setdefault(name, []).append(value)
            loops = lab.loop - first
            if lab.setting == probe.setting:
                lab.clear()
        except Exception as error:  # a game that nobody has tried yet may do anything; the others go on
            log.warning("probe %s failed", probe.id, exc_info=True)
            failed = f"{type(error).__name__}: {error}"
            samples = {}
            self._lab = None
        return Measured(
            unit=probe.unit,
            exact=probe.exact,
            resolution=probe.resolution,
            run_s=round(time.monotonic() - begun, 2),
            loops=max(0, loops),
            failed=failed,
            values={name: Values.of(some) for name, some in sorted(samples.items())},
        )

    def _ready(self, probe: Probe) -> Lab:
        """Return the game of the probe's setting, a new one if the last probe had another setting."""
        if self._lab is None or self._lab.setting != probe.setting:
            self._lab = Lab(self._connection, probe.setting, seed=self._seed)
        return self._lab
