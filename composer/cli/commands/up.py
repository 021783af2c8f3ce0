"""``compose up``: one word to a whole running system."""

from __future__ import annotations

from composer.cli.support.help import examples
from composer.cli.support.ros import Timeout
from composer.cli.support.system_commands import DEFAULT_TIMEOUT_S, command_system
from composer.cli.support.system_name import RunningSystem

EPILOG = examples(
    "compose up pipeline                   after a reset, or run with --autostart unconfigured",
    "compose up systems/pipeline.yaml",
    "compose up /robot1/pipeline",
)


def up(system: RunningSystem, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Bring a running system up: every node to where a start takes it.

    It is brought up as a whole or not at all: where a node fails, what was started is taken back in
    reverse, and the node and the cause are named. Nodes that had failed get a new chance. The
    process itself is started with ``compose run``.
    """
    command_system("up", "startup", system, timeout)
