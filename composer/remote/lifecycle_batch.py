"""Several lifecycle nodes taken through a transition, or to a state, one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from composer.remote.lifecycle import Change, Control
from composer.remote.session import Deadline, RosError, Session
from composer.remote.systems import Systems

_UPWARD = ("configure", "activate")
_RANK = {"unconfigured": 0, "inactive": 1, "active": 2}


@dataclass(frozen=True, slots=True)
class Request:
    """What is wanted of a node: a transition by its label, or else the state to be in."""

    transition: str | None
    state: str | None


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a wish for one node: the change, or why there was none."""

    change: Change | None
    error: RosError | None


def nodes_of_system(
    session: Session, deadline: Deadline, name: str, wish: Request
) -> tuple[str, ...]:
    """Return the nodes of a running system in the order that is right for the wish.

    What goes up goes in the order of the bring-up, what goes down before that and in reverse.
    Raises NotThere and NoAnswer.
    """
    systems = Systems(session, deadline)
    nodes = systems.report(systems.find(name)).nodes
    names = [node.node for node in nodes]
    if wish.state is None:
        return tuple(names if wish.transition in _UPWARD else names[::-1])
    goal = _RANK.get(wish.state, -1)
    falling = [node.node for node in nodes if _RANK.get(node.state, 0) > goal]
    return (*falling[::-1], *(node for node in names if node not in falling))


def change_each(
    session: Session, deadline: Deadline, targets: Iterable[str], wish: Request
) -> Iterator[Outcome]:
    """Do it to every node that is meant; a failure does not keep from the others.

    Raises NotThere, before anything is done.
    """
    control = Control(session, deadline)
    for node in control.select(targets):
        try:
            yield Outcome(_change(control, node, wish), None)
        except RosError as error:
            yield Outcome(None, error)


def _change(control: Control, node: str, wish: Request) -> Change:
    if wish.state is not None:
        return control.take(node, wish.state)
    return control.change(node, wish.transition or "")
