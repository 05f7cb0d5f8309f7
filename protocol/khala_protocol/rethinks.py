"""How often an agent may rethink; apart from the messages, so that `--help` need not wait for pydantic."""

from typing import Final

MAX_RETHINKS: Final = 3
"""Most verdicts on the replies of an agent to one observation: each reply costs the host a reading."""
