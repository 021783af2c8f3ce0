"""What the commands to a running system share: they ask its manager node and say what it says."""

from __future__ import annotations

from composer.cli.support.failure import Failure
from composer.cli.support.ros import ros_session
from composer.cli.support.system_name import name_of_system
from composer.cli.support.terminal import write

#: Nodes may take their time to change state: as long as a transition may take, and a bit more.
DEFAULT_TIMEOUT_S = 15.0


def command_system(command: str, service: str, text: str, timeout_s: float) -> None:
    """Have the system that ``text`` means do something, and print how it is then.

    Raises Failure when there is no such system, or it could not do it.
    """
    name = name_of_system(text)
    with ros_session(f"compose {command}", timeout_s) as (session, deadline):
        from composer.remote.systems import Systems

        systems = Systems(session, deadline)
        found = systems.find(name)
        success, message = systems.command(found, service)
    if not success:
        raise Failure(f"{found} did not {_VERBS.get(command, command)}: {message}", hint=_HINT)
    write(f"{found}: {message}")


_VERBS = {"up": "come up"}
_HINT = "its log says more; 'compose ps' shows every node"
