"""Hatchling build hook: compile the bytecode of an editable install.

pip compiles bytecode for regular installs only. In environments that disable writing bytecode,
``compose`` would otherwise be compiled on every start.
"""

from __future__ import annotations

import compileall
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CompileEditable(BuildHookInterface):  # type: ignore[type-arg]
    """Compile the package in place for editable installs."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, _build_data: dict[str, Any]) -> None:
        """Compile the package if ``version`` is "editable"."""
        if version == "editable":
            compileall.compile_dir(Path(self.root, "composer"), quiet=1)
