"""The loader of the simulator's YAML files."""

from __future__ import annotations

from typing import Any

import yaml

LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The fastest safe one that is there: libyaml reads six times faster, and is not in every wheel."""
