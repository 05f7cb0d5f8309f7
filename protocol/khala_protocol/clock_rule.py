"""The rules of time. Apart from the messages, because the command line shows them without pydantic."""

from typing import Literal

ClockRule = Literal["frozen", "budget", "token", "realtime"]
