"""Forms: unit types that a unit of another type turns into and back, or grows into: sieged, burrowed, flying, a Lair.

Where a task speaks of a type, it means its forms as well: they stay in their teams (`khala_bridge.state.teams`) and may
be told what the type may (`khala_bridge.task.config`). Names only; how a form differs is told by
`khala_bridge.knowledge`.
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
"""By the name of a form: the type as which it counts where no team lists the form."""
FORM_SUFFIXES = ("Burrowed", "Flying", "Uprooted")
"""Ends of the names of forms that are made of the type's own name."""


def form_of(name: str) -> str | None:
    """The type that a unit type is another form of; None if it is no form.

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
    """All forms of a unit type, forms of its forms among them, without itself.

    >>> forms_of("SiegeTank")
    ('SiegeTankSieged',)
    """
    direct = [form for form in knowledge() if form_of(form) == name]
    return tuple(dict.fromkeys(each for form in direct for each in (form, *forms_of(form))))
