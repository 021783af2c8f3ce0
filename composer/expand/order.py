"""Topological order of names that use each other, and the cycles among them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping


def dependency_order(uses: Mapping[str, Iterable[str]]) -> tuple[list[str], list[list[str]]]:
    """Return the names, each after those that it uses, and the cycles.

    The order leaves out names on a cycle and names that use them. Of cycles that share names, one
    is returned. The time is linear in the number of uses.
    """
    needs = {name: dict.fromkeys(used for used in uses[name] if used in uses) for name in uses}
    users: dict[str, list[str]] = {name: [] for name in uses}
    for name, used in needs.items():
        for other in used:
            users[other].append(name)
    missing = {name: len(used) for name, used in needs.items()}
    ready = deque(name for name, count in missing.items() if count == 0)
    order = []
    while ready:
        name = ready.popleft()
        order.append(name)
        for user in users[name]:
            missing[user] -= 1
            if missing[user] == 0:
                ready.append(user)
    return order, _cycles({name: needs[name] for name, count in missing.items() if count})


def _cycles(needs: Mapping[str, Iterable[str]]) -> list[list[str]]:
    """Return the cycles among names that each need another of them."""
    following = {name: next(used for used in needs[name] if used in needs) for name in needs}
    walk_of: dict[str, str] = {}  # by name: the start of the walk that first visited it
    cycles = []
    for start in needs:
        name = start
        while name not in walk_of:
            walk_of[name] = start
            name = following[name]
        if walk_of[name] == start:
            cycle = [name]
            while following[cycle[-1]] != name:
                cycle.append(following[cycle[-1]])
            cycles.append(cycle)
    return cycles
