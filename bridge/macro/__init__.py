"""What the host finds out for an agent that left it open: who trains, where a building stands, which way to scout.

A rule never overrides what an agent said; it finds the argument that is missing, or says why there is none.
"""

from bridge.macro.ledger import Ledger
from bridge.macro.rule import Ask, Impossible, Order, Rule

__all__ = ["RULES", "Ask", "Impossible", "Ledger", "Order", "Rule"]

RULES: dict[str, Rule] = {}
"""Every rule by the name under which the catalogue asks for it."""
