"""``compose down``: one word to a whole running system."""

from __future__ import annotations

from composer.cli.support.help import examples
from composer.cli.support.ros import Timeout, ros_session
from composer.cli.support.system_commands import DEFAULT_TIMEOUT_S
from composer.cli.support.system_name import RunningSystem, name_of_system
from composer.cli.support.terminal import write

EPILOG = examples(
    "compose down pipeline",
    "compose down systems/pipeline.yaml",
    "compose down /robot1/pipeline",
)


def down(system: RunningSystem, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """End a running system: every node is taken down in reverse, and its process ends."""
    name = name_of_system(system)
    with ros_session("compose down", timeout) as (session, deadline):
        from composer.remote.systems import Systems

        systems = Systems(session, deadline)
        found = systems.find(name)
        message = systems.end(found)
    write(f"{found}: {message}")
