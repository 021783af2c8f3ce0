"""What a method of a behaviour calls, itself and through others."""

from __future__ import annotations

from collections.abc import Iterator

from composer.behavior_source import BehaviorSource, Call, Method


def calls_of(source: BehaviorSource, method: Method) -> Iterator[Call]:
    """Yield what ``method`` calls, itself and through the methods of its class that it calls."""
    for reached in _reached(source, method):
        yield from reached.calls


def handed_on(source: BehaviorSource) -> frozenset[str]:
    """Return the publishers that the behaviour gives away or keeps, for a use nobody sees."""
    return frozenset(port for method in source.methods for port in method.publishing.handed_on)


def _reached(source: BehaviorSource, method: Method) -> Iterator[Method]:
    pending, seen = [method], {method.name}
    while pending:
        current = pending.pop()
        yield current
        for call in current.calls:
            name = call.name.removeprefix("self.")
            is_own = call.name.startswith("self.") and not call.deferred
            following = source.method(name) if is_own else None
            if following is not None and name not in seen:
                seen.add(name)
                pending.append(following)
