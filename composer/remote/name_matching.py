"""Finding a node by what people call it: a full name, or the last part of just one."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from rclpy.exceptions import InvalidTopicNameException
from rclpy.validate_full_topic_name import validate_full_topic_name

from composer.diagnostics import nearest
from composer.names import topic_name_problem
from composer.remote.session import Deadline, NoAnswer, RosError, Session

_MOST_LISTED = 8


class NotThere(RosError):
    """Nothing of that name is in the graph, or more than one; the hint says what is close."""


class BadName(RosError):
    """No topic, service or action can have that name."""


def full_name(kind: str, name: str) -> str:
    """Return the name that is meant: without a leading slash the one in the root namespace.

    Raises BadName for what ROS does not take.
    """
    wanted = name if name.startswith("/") else f"/{name}"
    try:
        validate_full_topic_name(wanted)
    except InvalidTopicNameException as error:
        problem = topic_name_problem(wanted) or "is not valid"
        raise BadName(f"{kind} name '{wanted}' {problem}") from error
    return wanted


def find_node(
    session: Session,
    deadline: Deadline,
    name: str,
    look: Callable[[], tuple[str, ...]],
    kind: str = "node",
) -> str:
    """Return the full name that ``name`` means among what ``look`` finds, once it is there.

    That is a full name, or the last part (or parts) of just one. Raises NotThere; NoAnswer when it
    may be in a system that does not answer.
    """
    found = session.search(lambda: _matches(name, look()) or None, deadline)
    if found is None:
        check_all_answer(session)
        raise not_there(kind, name, look())
    if name not in found:  # a part of a name: are there others with the same part?
        found = _matches(name, session.wait_until_still(look, deadline))
    if len(found) > 1:
        raise NotThere(f"'{name}' is more than one {kind}", "say which: " + ", ".join(found))
    return found[0]


def check_all_answer(session: Session) -> None:
    """Raise NoAnswer when a system of this computer is not met: not all nodes are known then."""
    for name, pid in session.silent_systems().items():
        raise NoAnswer(
            f"system '{name}' does not answer, so its nodes are not known",
            f"its process {pid} may be busy or stopped",
        )


def not_there(kind: str, name: str, known: Iterable[str]) -> NotThere:
    """Return the error that names what is there instead of ``name``."""
    return NotThere(f"there is no {kind} '{name}'", _what_is_there(kind, name, list(known)))


def _matches(name: str, known: tuple[str, ...]) -> tuple[str, ...]:
    """Return the nodes with that full name, else those whose name ends with it."""
    if name in known:
        return (name,)
    if name.startswith("/"):
        return ()
    return tuple(node for node in known if node.endswith(f"/{name}"))


def _what_is_there(kind: str, name: str, known: list[str]) -> str:
    if not known:
        return (
            f"no {kind} was found at all: is the system running, with the same ROS_DOMAIN_ID and"
            " discovery range?"
        )
    close = nearest(name, known)
    if close is None:
        by_last_part = {found.rpartition("/")[2]: found for found in known}
        match = nearest(name.rpartition("/")[2], by_last_part)
        close = by_last_part[match] if match is not None else None
    if close is not None:
        return f"did you mean '{close}'?"
    more = ", ..." if len(known) > _MOST_LISTED else ""
    return "there are: " + ", ".join(known[:_MOST_LISTED]) + more
