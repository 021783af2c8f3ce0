"""``compose down``: one word to a whole running system."""

from __future__ import annotations

from composer.cli.help import examples
from composer.cli.ros import Timeout
from composer.cli.system_commands import DEFAULT_TIMEOUT_S, command_system
from composer.cli.system_name import RunningSystem

EPILOG = examples(
    "compose down pipeline",
    "compose down systems/pipeline.yaml",
    "compose down /robot1/pipeline",
)


def down(system: RunningSystem, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """End a running system: every node is taken down in reverse, and its process ends."""
    command_system("down", "shutdown", system, timeout)
