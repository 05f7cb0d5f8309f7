"""What can go wrong between Khala and the game.

    khala_protocol.errors.KhalaError
    ├── GameError            the game could not be started, died, hangs or broke its contract
    │   ├── GameMissing      StarCraft II or the map is not where it should be
    │   └── GameHangs        the game did not answer in time and was ended
    └── CatalogueError       the tables of actions or functions are wrong, or do not fit the installed PySC2

A wrong action of a model is none of these: it is a `khala_protocol.messages.Rejection`.
"""

from __future__ import annotations

from khala_protocol.errors import KhalaError


class GameError(KhalaError):
    """The game could not be started, died, or broke its contract; the match cannot go on."""


class GameMissing(GameError):
    """The game or the map is not where it should be."""


class GameHangs(GameError):
    """The game did not answer in time; its process was ended."""


class CatalogueError(KhalaError):
    """A table of text actions or of functions contradicts itself or the installed PySC2."""
