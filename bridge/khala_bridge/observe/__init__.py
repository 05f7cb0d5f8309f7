"""What agents see: units → teams → views → text and pictures.

    observer   the way through all of it, snapshot after snapshot
    teams      which unit answers to which agent              stages      where a team is in its task
    scene      what stands on each team's screen              body        a unit as all see it
    events     what changed since the snapshot before         chronicle   what is remembered of an episode
    possible   what may be told now, and why not the rest
    side, landmarks   what those are told who lead or build the whole side
    observation   all of this as a value                      text, image  in words; in pictures

Everything here is a function of snapshots and of what agents said; no clock, no bus.
"""

from khala_bridge.observe.observation import AgentObservation, SideObservation, TeamObservation
from khala_bridge.observe.observer import Observer
from khala_bridge.observe.text import Feedback

__all__ = ["AgentObservation", "Feedback", "Observer", "SideObservation", "TeamObservation"]
