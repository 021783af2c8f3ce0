"""``compose down``: shut down a running system."""

from __future__ import annotations

from composer.cli.support.options import CHANGE_TIMEOUT_S, Timeout, examples
from composer.cli.support.output.terminal import lines, write
from composer.cli.support.ros import ros_session
from composer.cli.support.system_arguments import RunningSystem, running_system_name

EPILOG = examples(
    "compose down pipeline",
    "compose down systems/pipeline.yaml",
    "compose down /robot1/pipeline",
)


def down(system: RunningSystem, timeout: Timeout = CHANGE_TIMEOUT_S) -> None:
    """Shut down a running system and its process.

    The nodes are shut down in the reverse order of the bring-up.
    """
    name = running_system_name(system)
    with ros_session("compose down", timeout) as (session, deadline):
        from composer.client.systems.managers import Systems

        systems = Systems(session, deadline)
        full_name = systems.find(name)
        message = systems.shut_down(full_name)
    write(lines([f"{full_name}: {message}"]))
