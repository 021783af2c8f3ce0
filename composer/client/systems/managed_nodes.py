"""The nodes of running systems, as their managers report them."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase

from composer.client.name_matching import NotFoundError, not_found_error
from composer.client.session import Deadline, NoResponseError, Session
from composer.client.systems.managers import Systems, without_members
from composer.runtime.process.instance_lock import local_systems

#: Managers publish their last report to each new subscription, and again every second.
_REPORT_WITHIN_S = 2.0


def find_managed_nodes(
    session: Session, deadline: Deadline, systems: Systems, targets: Iterable[str]
) -> dict[str, tuple[str, ...]]:
    """Return the nodes that match the targets, by the systems that manage them.

    A target is a full name, the last part of a name, or a pattern. Raises NotFoundError;
    NoResponseError if a target is not found and a system does not respond.
    """
    names: Iterable[str] = {
        *session.wait_until_settled(systems.discover, deadline),
        *local_systems(),
    }
    names = without_members(names)  # the others move their nodes for one of these
    reports = systems.reports(names, Deadline(min(_REPORT_WITHIN_S, deadline.left_s)))
    system_of = {
        node.node: name for name, report in reports.items() if report for node in report.nodes
    }
    silent = [name for name, report in reports.items() if report is None]
    found: dict[str, dict[str, None]] = {}
    for target in targets:
        for node in _matches(target, system_of, silent):
            found.setdefault(system_of[node], {})[node] = None
    return {system: tuple(nodes) for system, nodes in found.items()}


def _matches(target: str, known: Iterable[str], silent: list[str]) -> list[str]:
    is_pattern = any(character in target for character in "*?[")
    pattern = target if target.startswith("/") else f"*/{target}"
    found = [node for node in known if fnmatchcase(node, pattern)]
    if not found and silent:
        raise NoResponseError(
            f"{silent[0]} does not respond, so its nodes are not known",
            "its process may be busy or stopped",
        )
    if not found:
        raise not_found_error("node of a running system", target, known)
    if len(found) > 1 and not is_pattern:
        raise NotFoundError(
            f"'{target}' matches more than one node", f"use a full name: {', '.join(found)}"
        )
    return found
