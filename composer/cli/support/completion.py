"""Shell completion of names in the ROS graph, of rules and of interface types.

Names come only from the systems that run on this computer: joining the ROS graph takes too long for
a key press. A failure offers nothing, because the shell would print it into the command line.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import wraps
from typing import ParamSpec

#: A busy system delays a key press no longer than this.
WITHIN_S = 0.3

P = ParamSpec("P")
Complete = Callable[[str], list[str]]


def silent(complete: Callable[P, list[str]]) -> Callable[P, list[str]]:
    """Return ``complete`` without its errors: nothing is offered instead."""

    @wraps(complete)
    def without_errors(*args: P.args, **kwargs: P.kwargs) -> list[str]:
        try:
            return complete(*args, **kwargs)
        except Exception:  # whatever it is, the shell cannot show it
            return []

    return without_errors


@silent
def complete_node(incomplete: str) -> list[str]:
    """Complete the full name of a node, or its last part."""
    names = _graph_names("node", incomplete)
    if incomplete and not incomplete.startswith("/"):
        names = [name.rpartition("/")[2] for name in names]
    return _starting_with(incomplete, names)


@silent
def complete_running_system(incomplete: str) -> list[str]:
    """Complete the full name of a running system, or its last part."""
    from composer.runtime.process.instance_lock import local_systems

    names = sorted(local_systems())
    if not incomplete.startswith("/"):
        names = [name.rpartition("/")[2] for name in names]
    return _starting_with(incomplete, names)


@silent
def complete_rule(incomplete: str) -> list[str]:
    """Complete the code or the name of a rule."""
    from composer.report.rules import all_rules

    rules = all_rules()
    return _starting_with(
        incomplete, [*(item.code for item in rules), *(item.name for item in rules)]
    )


@silent
def complete_interface_package(incomplete: str) -> list[str]:
    """Complete the name of a package with message, service or action types."""
    from composer.interfaces import Interfaces

    return _starting_with(incomplete, sorted(Interfaces.load().packages()))


def _graph_names(kind: str, incomplete: str) -> list[str]:
    """Return the names of one kind, hidden ones only if they are asked for."""
    from composer.client.systems.local_queries import local_names

    found = local_names(kind, WITHIN_S, hidden="/_" in incomplete) or ()
    return [name for name, _ in found]


def _starting_with(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in dict.fromkeys(names) if name.startswith(incomplete)]


def _complete_graph(kind: str) -> Complete:
    """Return a function that completes names of topics, services or actions.

    The leading slash may be missing.
    """

    @silent
    def complete(incomplete: str) -> list[str]:
        names = _graph_names(kind, incomplete)
        if incomplete and not incomplete.startswith("/"):
            names = [name.removeprefix("/") for name in names]
        return _starting_with(incomplete, names)

    return complete


def _complete_types(*folders: str) -> Complete:
    """Return a function that completes types of these kinds; all by default."""

    @silent
    def complete(incomplete: str) -> list[str]:
        from composer.interfaces import Interfaces

        return _starting_with(incomplete, Interfaces.load().names(*folders))

    return complete


complete_topic = _complete_graph("topic")
complete_service = _complete_graph("service")
complete_action = _complete_graph("action")
complete_message_type = _complete_types("msg")
complete_type = _complete_types()
