"""``compose reset``: one word to a whole running system."""

from __future__ import annotations

from composer.cli.support.help import examples
from composer.cli.support.ros import Timeout
from composer.cli.support.system_commands import DEFAULT_TIMEOUT_S, command_system
from composer.cli.support.system_name import RunningSystem

EPILOG = examples(
    "compose reset pipeline                then: compose up pipeline",
    "compose reset systems/pipeline.yaml",
    "compose reset /robot1/pipeline",
)


def reset(system: RunningSystem, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Take every node of a running system back to unconfigured, and forget failures."""
    command_system("reset", "reset", system, timeout)
