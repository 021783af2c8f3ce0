"""The order in which things that use each other can be worked out, and the circles among them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping


def dependency_order(uses: Mapping[str, Iterable[str]]) -> tuple[list[str], list[list[str]]]:
    """Return the names, each behind what it uses, and the circles.

    Names on a circle, and those that use them, are not in the order. Of circles that share names
    one is told. Takes time in proportion to the number of uses.
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
    return order, _circles({name: needs[name] for name, count in missing.items() if count})


def _circles(needs: Mapping[str, Iterable[str]]) -> list[list[str]]:
    """Return circles among names each of which needs another one of them."""
    following = {name: next(used for used in needs[name] if used in needs) for name in needs}
    walk_of: dict[str, str] = {}  # by name: the name with which the walk began that came by
    circles = []
    for start in needs:
        name = start
        while name not in walk_of:
            walk_of[name] = start
            name = following[name]
        if walk_of[name] == start:
            circle = [name]
            while following[circle[-1]] != name:
                circle.append(following[circle[-1]])
            circles.append(circle)
    return circles
