"""``compose pause``: one word to a whole running system."""

from __future__ import annotations

from composer.cli.support.help import examples
from composer.cli.support.ros import Timeout
from composer.cli.support.system_commands import DEFAULT_TIMEOUT_S, command_system
from composer.cli.support.system_name import RunningSystem

EPILOG = examples(
    "compose pause pipeline",
    "compose pause systems/pipeline.yaml",
    "compose pause /robot1/pipeline",
)


def pause(system: RunningSystem, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Deactivate every node of a running system, in reverse order of its bring-up."""
    command_system("pause", "pause", system, timeout)
