"""``compose resume``: one word to a whole running system."""

from __future__ import annotations

from composer.cli.support.help import examples
from composer.cli.support.ros import Timeout
from composer.cli.support.system_commands import DEFAULT_TIMEOUT_S, command_system
from composer.cli.support.system_name import RunningSystem

EPILOG = examples(
    "compose resume pipeline",
    "compose resume systems/pipeline.yaml",
    "compose resume /robot1/pipeline",
)


def resume(system: RunningSystem, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Activate the inactive nodes of a running system again, in order."""
    command_system("resume", "resume", system, timeout)
