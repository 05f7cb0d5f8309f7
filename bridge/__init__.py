"""Between PySC2 and text: what an agent sees, and what its words do.

Synchronous and pure, except `bridge.game`, which owns the one PySC2 environment of a match.
Above it: `orchestrator`. Below it: `protocol`. It knows nothing of buses, agents or deadlines.
"""
