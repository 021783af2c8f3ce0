"""Bytecode for an editable install, as pip makes it of what it installs otherwise.

Hatchling calls it when it builds. Where Python is not to write bytecode itself, every start of
``compose`` would compile all of it anew.
"""

from __future__ import annotations

import compileall
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CompileEditable(BuildHookInterface):  # type: ignore[type-arg]
    """Compiles the package where it is, when it is installed from there."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, _build_data: dict[str, Any]) -> None:
        """Do so for the version of a wheel that is called editable, and nothing for others."""
        if version == "editable":
            compileall.compile_dir(Path(self.root, "composer"), quiet=1)
