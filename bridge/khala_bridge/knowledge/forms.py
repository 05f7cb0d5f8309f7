"""Forms: unit types that a unit of another type turns into and back, or grows into: sieged, burrowed, flying, a Lair.

A task that names a type means its forms as well: they stay in their teams (`khala_bridge.state.teams`) and have the
type's actions (`khala_bridge.task.config`). Names only; `khala_bridge.knowledge` says how a form differs.
"""

from __future__ import annotations

import functools

from khala_bridge.knowledge import knowledge

FORMS = {
    "BanelingCocoon": "Zergling",
    "BroodLordCocoon": "Corruptor",
    "GreaterSpire": "Spire",
    "Hellbat": "Hellion",
    "Hive": "Hatchery",
    "Lair": "Hatchery",
    "LiberatorAG": "Liberator",
    "LurkerCocoon": "Hydralisk",
    "ObserverSurveillanceMode": "Observer",
    "OrbitalCommand": "CommandCenter",
    "OrbitalCommandFlying": "CommandCenter",
    "OverlordTransport": "Overlord",
    "OverlordTransportCocoon": "Overlord",
    "OverseerCocoon": "Overlord",
    "OverseerOversightMode": "Overseer",
    "PlanetaryFortress": "CommandCenter",
    "RavagerCocoon": "Roach",
    "SiegeTankSieged": "SiegeTank",
    "SupplyDepotLowered": "SupplyDepot",
    "ThorHighImpactMode": "Thor",
    "VikingAssault": "VikingFighter",
    "WarpGate": "Gateway",
    "WarpPrismPhasing": "WarpPrism",
}
"""By the name of a form: the type that it counts as if no team lists the form."""
FORM_SUFFIXES = ("Burrowed", "Flying", "Uprooted")
"""Endings that make the name of a form from the type's own name."""


def form_of(name: str) -> str | None:
    """Return the type that a unit type is a form of; None if it is not a form.

    >>> form_of("RoachBurrowed"), form_of("SiegeTankSieged"), form_of("Roach")
    ('Roach', 'SiegeTank', None)
    """
    if name in FORMS:
        return FORMS[name]
    for suffix in FORM_SUFFIXES:
        if name.endswith(suffix) and name != suffix:
            return name.removesuffix(suffix)
    return None


@functools.cache
def forms_of(name: str) -> tuple[str, ...]:
    """Return all forms of a unit type, including forms of its forms, without itself.

    >>> forms_of("SiegeTank")
    ('SiegeTankSieged',)
    """
    direct = [form for form in knowledge() if form_of(form) == name]
    return tuple(dict.fromkeys(each for form in direct for each in (form, *forms_of(form))))
