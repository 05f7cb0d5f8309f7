"""What agents see: units → teams → views → text.

`teams` says which unit answers to which agent; `sight` makes the typed view of every team from a snapshot, `events`
compares it with the one before, `text` writes it down with what is known of the types in it. `observer` is the way
through all of it. Everything here is a function of snapshots and of what agents said; no clock, no bus.
"""

from bridge.observe.observer import Observer
from bridge.observe.sight import AgentSight, Sight, TeamSight
from bridge.observe.text import Feedback

__all__ = ["AgentSight", "Feedback", "Observer", "Sight", "TeamSight"]
