"""Is it possible now, what is missing, and what does it cost: one answer for everybody who asks.

    why_not(use, unit, side, ledger)    None, or an `Unavailable`: the kind of reason and its figures
    brief(why)                          in the list of what is not possible: `needs 50 energy, there is 8`
    of_team(why), of_side(why)          in a refusal, of a team's units or of the whole side
    ledger.pay(price_of(facts))         what a use costs, taken from the accounts of a turn

Functions of plain values (`Side`, `Unit`, `Ledger`) that `bridge.means` reads from a snapshot; nothing here knows the
SC2 API. Above are `bridge.observe` (what is offered), `bridge.act` (what is refused) and `bridge.macro` (what the host
finds and orders); below is `bridge.knowledge`. Places and targets are not judged here: they need the ground.
"""

from bridge.rules.cost import Cost, Shortfall, cases, facts_for, is_free, price_of
from bridge.rules.judge import AT_ONCE, Use, asked_by, nearest, nobody, sure, use_of, why_no_one, why_not
from bridge.rules.ledger import Ledger
from bridge.rules.unavailable import Kind, Unavailable, rank
from bridge.rules.values import Side, Unit, distinct
from bridge.rules.weapons import ATTACK, is_attack
from bridge.rules.words import brief, of_side, of_team

__all__ = [
    "ATTACK",
    "AT_ONCE",
    "Cost",
    "Kind",
    "Ledger",
    "Shortfall",
    "Side",
    "Unavailable",
    "Unit",
    "Use",
    "asked_by",
    "brief",
    "cases",
    "distinct",
    "facts_for",
    "is_attack",
    "is_free",
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
