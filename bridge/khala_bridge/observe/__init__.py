"""What agents see: units → teams → views → text and pictures.

    observer   runs all of it, snapshot after snapshot        stages      a team's stage in its task
    scene      the units on each team's screen                looks       who is on which screen, for all teams
    body       the part of a unit's view that all share
    events     changes since the snapshot before              chronicle   a side's memory of an episode
    offers     possible actions, and why not the others       side, landmarks   for agents of the whole side
    observation   all of this as a value                      text, image  in words; in pictures
    feedback   the results of the last reply, and messages    mark_digits   parts of tags that stand for units

Everything here is a function of snapshots and of agents' replies; no clock, no bus.
"""

from khala_bridge.observe.feedback import Feedback, shorten
from khala_bridge.observe.observation import AgentObservation, SideObservation, TeamObservation
from khala_bridge.observe.observer import Observer
from khala_bridge.observe.text.reply import rejection_line

__all__ = [
    "AgentObservation",
    "Feedback",
    "Observer",
    "SideObservation",
    "TeamObservation",
    "rejection_line",
    "shorten",
]
