"""What can go wrong between Khala and the game.

    khala_protocol.errors.KhalaError
    ├── GameError            the game could not be started, died, hangs or broke its contract
    │   ├── GameMissing      there is no StarCraft II, or no such map, where it was looked for
    │   └── GameHangs        the game did not answer in time and was ended
    └── CatalogueError       the tables of actions or functions are wrong, or not those of the PySC2 that is installed

A wrong action of a model is none of these: it is a `khala_protocol.messages.Rejection`.
"""

from __future__ import annotations

from khala_protocol.errors import KhalaError


class GameError(KhalaError):
    """The game could not be started, died, or broke its contract; the match cannot go on."""


class GameMissing(GameError):
    """There is no game, or no map, where it was looked for."""


class GameHangs(GameError):
    """The game did not answer in time; its process was ended."""


class CatalogueError(KhalaError):
    """A table of text actions or of functions contradicts itself, or the PySC2 that is installed."""
