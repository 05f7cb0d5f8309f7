"""Is it possible now, what is missing, and what does it cost: one answer for all callers.

    why_not(use, unit, side, ledger)    None, or an `Unavailable`: the kind of reason and its figures
    brief(why)                          in the list of what is not possible: `needs 50 energy, there is 8`
    of_team(why), of_side(why)          in a refusal, of a team's units or of the whole side
    ledger.pay(price_of(facts))         what a use costs, taken from the accounts of a turn

Functions of plain values (`SideState`, `UnitState`, `Ledger`) that `khala_bridge.state.means` reads from a snapshot;
nothing here knows the SC2 API. Above are `khala_bridge.observe`, which offers actions, `khala_bridge.act`, which
refuses them, and `khala_bridge.auto`, which finds the host's orders; below is `khala_bridge.knowledge`. Places and
targets are not judged here: they need the ground.
"""

from khala_bridge.rules.cost import Cost, Shortfall, cases, facts_for, is_free, is_instant, price_of
from khala_bridge.rules.judge import AT_ONCE, Use, asked_by, nearest, nobody, sure, use_of, why_no_one, why_not
from khala_bridge.rules.ledger import Ledger
from khala_bridge.rules.unavailable import Kind, Unavailable, rank
from khala_bridge.rules.values import SideState, UnitState, distinct
from khala_bridge.rules.weapons import ATTACK, is_attack
from khala_bridge.rules.words import brief, of_side, of_team

__all__ = [
    "ATTACK",
    "AT_ONCE",
    "Cost",
    "Kind",
    "Ledger",
    "Shortfall",
    "SideState",
    "Unavailable",
    "UnitState",
    "Use",
    "asked_by",
    "brief",
    "cases",
    "distinct",
    "facts_for",
    "is_attack",
    "is_free",
    "is_instant",
    "nearest",
    "nobody",
    "of_side",
    "of_team",
    "price_of",
    "rank",
    "sure",
    "use_of",
    "why_no_one",
    "why_not",
]
