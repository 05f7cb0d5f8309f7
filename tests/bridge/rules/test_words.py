"""Every reason in its three forms: in the list of impossible actions, in a team's refusal, in a side's."""

from __future__ import annotations

from typing import get_args

import pytest

from khala_bridge.rules import Cost, Kind, Ledger, Shortfall, Unavailable, brief, of_side, of_team

TECHLESS = Unavailable("requirement", "Gateway", names=("TemplarArchive", "DarkShrine", "Blink"), begun=("DarkShrine",))
POOR = (Shortfall("minerals", 100, 60, 150), Shortfall("supply", 2, -4))
LARVA = "wait for the next one"
ROWS = [
    (Unavailable("nobody", "Larva"), "no Larva", "there is no Larva", f"you have no Larva; {LARVA}."),
    (Unavailable("ability", "Zealot"), "Zealot cannot", "Zealot has no such ability", "Zealot has no such ability."),
    (Unavailable("weapon", "Observer"), "Observer has no weapon", "Observer has no weapon", "Observer has no weapon."),
    (
        Unavailable("disarmed", "Phoenix"),
        "the weapon of Phoenix is off",
        "the weapon of Phoenix is off while it holds up a unit or a spell disarms it",
        "the weapon of your Phoenix is off while it holds up a unit or a spell disarms it.",
    ),
    (
        Unavailable("unfinished", "Gateway", has=0.43),
        "Gateway is not finished",
        "Gateway is still under construction (43%)",
        "your Gateway is not finished yet, it is at 43%.",
    ),
    (
        Unavailable("researched", "Forge", names=("Blink",)),
        "researched already",
        "Blink is researched already",
        "it is researched already.",
    ),
    (
        Unavailable("researching", "Forge", names=("Blink",)),
        "being researched",
        "Blink is being researched already",
        "it is being researched already.",
    ),
    (
        TECHLESS,
        "no TemplarArchive, DarkShrine is not finished, Blink is not researched",
        "a finished TemplarArchive and a DarkShrine is needed first",
        "it needs a finished TemplarArchive and a finished DarkShrine and the upgrade Blink first.",
    ),
    (
        Unavailable("addon", "Barracks", names=("TechLab",)),
        "needs a TechLab",
        "Barracks needs a TechLab for it",
        "no Barracks has a TechLab; Build_TechLab_Barracks makes one.",
    ),
    (
        Unavailable("energy", "Nexus", tag=0x123, needs=50, has=8.9),
        "needs 50 energy, there is 8",
        "Nexus has 8 energy and it takes 50",
        "it needs 50 energy, and your Nexus 0x123 has 8.",
    ),
    (
        Unavailable("price", "Gateway", missing=POOR),
        "40 more minerals needed, 6 more supply needed",
        "it takes 100 minerals and 60 are left, 150 more are for what workers are on their way to build",
        "it costs 100 minerals and 60 are left, 150 more are for what workers are on their way to build.",
    ),
    (
        Unavailable("price", "Hatchery", missing=POOR[1:]),
        "6 more supply needed",
        "it takes 2 supply and -4 is left",
        "it needs 2 supply and -4 is free; get an Overlord first.",
    ),
    (
        Unavailable("taken", "Larva"),
        "Larva has an order already",
        "Larva has an order already in this turn",
        "every Larva has an order already in this turn.",
    ),
    (
        Unavailable("taken", "WarpGate"),
        "WarpGate has an order already",
        "WarpGate has an order already in this turn",
        "every WarpGate recharges; wait until one is ready.",
    ),
    (
        Unavailable("occupied", "Probe"),
        "no Probe is free to build",
        "Probe is not free to build",
        "you have no Probe that is free to build.",
    ),
    (
        Unavailable("queue", "Gateway"),
        "the queue of Gateway is full",
        "the queue of Gateway is full",
        "the queue of every Gateway is full; wait until one is done or build another.",
    ),
    (
        Unavailable("attached", "Barracks"),
        "Barracks has an add-on already",
        "Barracks has an add-on already",
        "every idle Barracks has an add-on already; build another Barracks.",
    ),
    (
        Unavailable("at_work", "Hatchery"),
        "Hatchery is at work",
        "Hatchery is at work",
        "every Hatchery is at work; it can be done when one has nothing in its queue.",
    ),
    (
        Unavailable("power", "Gateway", among=("Gateway", "Forge")),
        "no Gateway or Forge has power",
        "Gateway has no power",
        "your Gateway has no power; build a Pylon near it.",
    ),
    (
        Unavailable("cooldown", "Stalker", needs=7.14),
        "cooling down",
        "Stalker cannot again so soon, it takes 7.14 s after each use",
        "your Stalker cannot again so soon, it takes 7.14 s after each use.",
    ),
    (
        Unavailable("game", "SiegeTank", has=2),
        "not in its present state",
        "the game does not let SiegeTank do it now while it has 2 orders",
        "the game does not take it from your SiegeTank at this moment; try again later.",
    ),
]


@pytest.mark.parametrize(("why", "listed", "team", "side"), ROWS)
def test_a_reason_has_three_forms(why: Unavailable, listed: str, team: str, side: str) -> None:
    assert (brief(why), of_team(why), of_side(why)) == (listed, team, side)


def test_every_kind_of_reason_has_a_row() -> None:
    assert {why.kind for why, *_ in ROWS} == set(get_args(Kind))


def test_what_takes_no_supply_is_not_short_of_it_above_the_cap() -> None:
    ledger = Ledger(100, 0, -4)
    assert ledger.short_of(Cost(100, 0, 0)) == ()
    assert ledger.short_of(Cost(150, 25, 1)) == (
        Shortfall("minerals", 150, 100),
        Shortfall("vespene", 25, 0),
        Shortfall("supply", 1, -4),
    )
    assert ledger.times(Cost(30, 0, 0)) == 3


def test_as_many_pay_as_the_accounts_last_for() -> None:
    assert Ledger(100, 75, 2).payable([Cost(25, 25, 1)] * 5) == 2
