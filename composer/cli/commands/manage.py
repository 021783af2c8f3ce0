"""``compose up``, ``down``, ``pause``, ``resume`` and ``reset``: commands to a running system."""

from __future__ import annotations

from composer.cli.support.errors import CommandError
from composer.cli.support.options import Timeout, examples
from composer.cli.support.ros import ros_session
from composer.cli.support.system_arguments import RunningSystem, running_system_name
from composer.cli.support.terminal import lines, write

#: As long as a transition may take by default, with a margin.
_TIMEOUT_S = 15.0
_HINT = "see the log of the system; 'compose ps' shows the state of every node"


def _epilog(command: str, note: str = "") -> str:
    first = f"compose {command} pipeline"
    return examples(
        f"{first}{note.rjust(len(note) + 10)}" if note else first,
        f"compose {command} systems/pipeline.yaml",
        f"compose {command} /robot1/pipeline",
    )


EPILOGS = {
    "up": _epilog("up", "after 'compose reset' or 'compose run --autostart unconfigured'"),
    "down": _epilog("down"),
    "pause": _epilog("pause"),
    "resume": _epilog("resume"),
    "reset": _epilog("reset", "then: compose up pipeline"),
}


def up(system: RunningSystem, timeout: Timeout = _TIMEOUT_S) -> None:
    """Bring up the nodes of a running system.

    Each node is brought up to its autostart state. If a node fails, the bring-up is rolled back and
    the cause is reported. Nodes that failed before are retried. Use 'compose run' to start the
    process of a system.

    YAML and parameter files are not read again. To apply changes, restart the system: 'compose
    down', then 'compose run'.
    """
    _command("up", "startup", system, timeout, failure="did not come up")


def down(system: RunningSystem, timeout: Timeout = _TIMEOUT_S) -> None:
    """Shut down a running system and its process.

    The nodes are shut down in the reverse order of the bring-up.
    """
    name = running_system_name(system)
    with ros_session("compose down", timeout) as (session, deadline):
        from composer.remote.systems import Systems

        systems = Systems(session, deadline)
        found = systems.find(name)
        message = systems.shut_down(found)
    write(lines([f"{found}: {message}"]))


def pause(system: RunningSystem, timeout: Timeout = _TIMEOUT_S) -> None:
    """Deactivate all nodes of a running system.

    The nodes are deactivated in the reverse order of the bring-up.
    """
    _command("pause", "pause", system, timeout, failure="did not pause")


def resume(system: RunningSystem, timeout: Timeout = _TIMEOUT_S) -> None:
    """Activate the inactive nodes of a running system.

    The nodes are activated in the order of the bring-up.
    """
    _command("resume", "resume", system, timeout, failure="did not resume")


def reset(system: RunningSystem, timeout: Timeout = _TIMEOUT_S) -> None:
    """Reset all nodes of a running system.

    All nodes return to the state unconfigured, and failures are cleared. Use 'compose up' to bring
    them up again.

    Parameters keep their values, and YAML and parameter files are not read again. To apply
    changes, restart the system: 'compose down', then 'compose run'.
    """
    _command("reset", "reset", system, timeout, failure="did not reset")


def _command(command: str, service: str, text: str, timeout_s: float, *, failure: str) -> None:
    """Call a service of the manager of a system and print its response. Raises CommandError."""
    name = running_system_name(text)
    with ros_session(f"compose {command}", timeout_s) as (session, deadline):
        from composer.remote.systems import Systems

        systems = Systems(session, deadline)
        found = systems.find(name)
        success, message = systems.command(found, service)
    if not success:
        raise CommandError(f"{found} {failure}: {message}", hint=_HINT)
    write(lines([f"{found}: {message}"]))
