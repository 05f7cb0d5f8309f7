"""The skilled player: the baseline that every model is compared with. It plays from the text of an observation alone.

    skilled(observation, rng) -> reply

`kinds` is common knowledge of StarCraft II players; `space` is geometry on a screen; `plan` collects the calls of a
team; `skills`, `combat` and `journey` fill it for units, `brood` for Queens, `builder` for a worker that builds.
`economy` leads production for the whole side by the tables of `builds`, `command` the army. It keeps nothing from one
observation to the next, so that it can be asked like a model: it reads from the text whatever it needs to know.
"""

from khala_agents.scripted.skilled.player import skilled

__all__ = ["skilled"]
