"""Who plays against the agents of a task that has one side.

The computer player is inside the game. Everybody else brings a client of the game: a guest comes to a game that Khala
hosts, and over LAN Khala comes to a game that somebody else hosts.
"""

from __future__ import annotations

import shlex
from typing import Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from khala_bridge.task.maps import Difficulty, MapSpec, Race  # noqa: TC001  # pydantic evaluates them
from khala_protocol.messages import Frozen

LAN = "127.0.0.1:14380"
"""Where `python -m pysc2.bin.play_vs_agent --human` waits, unless it is given another port."""


class Opponent(Frozen):
    """The other player: the computer, a bot that joins, or the host of a game that Khala joins."""

    kind: Literal["computer", "guest", "lan"] = "computer"
    """`guest`: a bot that joins the game as on a ladder; `lan`: whoever hosts a game at `at`, such as a person with
    PySC2's `play_vs_agent --human`. See [play a bot](../how-to/play-a-bot.md)."""
    race: Race | None = None
    """Of the computer; null for the map's. Other opponents bring their own."""
    difficulty: Difficulty | None = None
    """Of the computer; null for the map's."""
    command: tuple[str, ...] = ()
    """Of a guest: what starts it, with its arguments; those of the ladder are appended. Without one, Khala prints the
    arguments and waits."""
    at: str = LAN
    """Of `lan`: the address of the game. The game plays over LAN on one machine only; tunnels are the host's."""
    wait_s: float = Field(default=120.0, gt=0, le=86_400)
    """Seconds that it may take to come, and later to go on with the game."""

    @field_validator("command", mode="before")
    @classmethod
    def _split_command(cls, command: Any) -> Any:
        return shlex.split(command) if isinstance(command, str) else command

    @field_validator("at")
    @classmethod
    def _on_this_machine(cls, at: str) -> str:
        host, _, port = at.rpartition(":")
        if host not in ("127.0.0.1", "localhost") or not (port.isdecimal() and 0 < int(port) < 2**16):
            raise ValueError(f"{at!r} is not 127.0.0.1:PORT: the game plays over LAN on one machine only")
        return f"127.0.0.1:{port}"

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.kind != "computer" and (self.race or self.difficulty):
            raise ValueError("only the computer is given a race and a difficulty: other opponents bring their own")
        if self.kind != "guest" and self.command:
            raise ValueError(f"only a guest is started by a command, but the opponent is of the kind {self.kind}")
        return self

    @property
    def joins(self) -> bool:
        """Whether it is a player with its own client of the game."""
        return self.kind != "computer"

    @property
    def port(self) -> int:
        """Port of `at`."""
        return int(self.at.rpartition(":")[2])

    @property
    def words(self) -> str:
        """What it is, as far as a task says."""
        return {"guest": "guest bot", "lan": f"player over LAN at {self.at}"}.get(self.kind, "computer")

    def against(self, played: MapSpec) -> str:
        """Return who it is on a map: `computer (zerg, easy)`, `guest bot`, `nobody`."""
        if self.joins:
            return self.words
        return f"computer ({played.opponent}, {played.difficulty})" if played.opponent else "nobody"


def opponent_of(words: str) -> dict[str, Any]:
    """Return the fields of an opponent in one line: `computer`, `guest`, `guest:python run.py`, `lan:127.0.0.1:14380`.

    Raises:
        ValueError: it is none of these.
    """
    kind, colon, rest = words.partition(":")
    if colon and kind == "guest":
        return {"kind": kind, "command": rest}
    if colon and kind == "lan":
        return {"kind": kind, "at": rest}
    if not colon and kind in ("computer", "guest", "lan"):
        return {"kind": kind}
    raise ValueError(f"{words!r} is not an opponent: give computer, guest, guest:COMMAND or lan:127.0.0.1:PORT")
