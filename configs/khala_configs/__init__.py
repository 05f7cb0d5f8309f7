"""The configuration that comes with Khala: task files, model files and agents files, as data.

In a checkout they are in `configs/tasks`, `configs/models` and `configs/agents`; a wheel carries them in this package.
"""

from pathlib import Path
from typing import Final

_PACKAGE: Final = Path(__file__).resolve().parent

CONFIGS: Final = _PACKAGE if (_PACKAGE / "tasks").is_dir() else _PACKAGE.parent
"""The directory with `tasks/`, `models/` and `agents/`."""
