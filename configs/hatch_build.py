"""Put the configuration files into wheels; an editable install reads them where they are."""

from __future__ import annotations

from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FOLDERS = ("agents", "arenas", "experiments", "models", "published", "tasks")


class ConfigFiles(BuildHookInterface):
    """A build hook that adds the folders next to the package to the package in the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name the folders that a wheel carries, by their places in it."""
        if version != "editable":
            build_data["force_include"].update({folder: f"khala_configs/{folder}" for folder in FOLDERS})
