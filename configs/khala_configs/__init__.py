"""The configuration that comes with Khala: task files, model files, agents files and experiments, as data.

In a checkout they are in folders of `configs`; a wheel carries them in this package.
"""

from pathlib import Path
from typing import Final

_PACKAGE: Final = Path(__file__).resolve().parent

CONFIGS: Final = _PACKAGE if (_PACKAGE / "tasks").is_dir() else _PACKAGE.parent
"""The directory with `tasks/`, `models/`, `agents/`, `experiments/` and `published/`."""
