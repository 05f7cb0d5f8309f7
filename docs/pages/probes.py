"""The page of the probes of `khala calibrate`, with the estimates of the simulator that each would settle."""

from __future__ import annotations

from typing import TYPE_CHECKING

from docs.pages.markdown import code, head, join, table
from khala_bridge.calibrate.catalogue import PROBES
from khala_sc2.calibrate.estimates import estimates, of_maps

if TYPE_CHECKING:
    from khala_bridge.calibrate.probe import Probe


def page() -> str:
    """Return the table of probes, the estimates by probe, and the estimates that none settles."""
    order = {probe.id: rank for rank, probe in enumerate(PROBES)}
    settled = sorted((one for one in estimates() if one.probe), key=lambda one: (order[one.probe], one.where))
    return join(
        head("Probes", "`bridge/khala_bridge/calibrate/probes` and the simulator's own lists of estimates"),
        "What `khala calibrate` measures, on the simulator and on [the real game](../how-to/real-game.md) alike. How "
        "probes are made and compared, what a run takes, and what it found of two versions: "
        "[calibration](../design/calibration.md).",
        "An *exact* probe gives the same number each time, up to the resolution; of one with *chance* the means of "
        "several values are compared.",
        table(("probe", "measures", "settles", "unit", "kind", "map"), [_row(probe) for probe in PROBES]),
        "## Estimates that they settle",
        "What the simulator only guesses, and the probe whose numbers of the real game would replace the guess.",
        table(("probe", "where", "estimate"), [(code(one.probe), one.where, one.what) for one in settled]),
        "## Estimates that no probe settles",
        f"Those of single maps: {of_maps()}. Of the rest:",
        table(
            ("where", "estimate", "why"), [(one.where, one.what, one.because) for one in estimates() if not one.probe]
        ),
    )


def _row(probe: Probe) -> tuple[str, ...]:
    kind = f"exact, ± {probe.resolution:g}" if probe.resolution else "exact"
    place = probe.setting.map.rpartition("/")[2].removesuffix(".SC2Map")
    return (
        code(probe.id), probe.measures, probe.settles, probe.unit, kind if probe.exact else "chance",
        f"{place}, fog" if probe.setting.fog else place,
    )  # fmt: skip
