"""Facts of buffs, from the simulator's tables: temporary effects on a unit, and what they change."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from khala_sc2.knowledge.measures import plain, seconds, sparse

if TYPE_CHECKING:
    from khala_simulator.tables.buffs import Buff
    from khala_simulator.tables.catalog import Catalog


def buff_facts(catalog: Catalog) -> dict[str, dict[str, Any]]:
    """Return one record for each buff that changes anything or that clients can see, by its name in the tables."""
    found = {buff.name: sparse(_buff(buff)) for buff in sorted(catalog.buffs, key=lambda buff: buff.name)}
    return {name: record for name, record in found.items() if record}


def _buff(buff: Buff) -> dict[str, Any]:
    factors = {"speed": buff.speed, "attack_rate": buff.attack_rate, "work_rate": buff.work_rate}
    response = buff.response
    return {
        "id": buff.id,
        "duration_s": seconds(buff.loops),
        **{name: plain(value) for name, value in factors.items() if value != 1},
        "stops_work": buff.work_rate == 0,
        "armor": plain(buff.armor_add),
        "damage_taken": plain(response.add) if response and response.on == "defender" else 0,
        "absorbs": plain(response.limit) if response else 0,
        "flags": sorted(buff.flags),
    }
