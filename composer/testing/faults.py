"""Faults that a test injects: messages that get lost or late, handlers that raise or hang."""

from __future__ import annotations

import functools
from collections import defaultdict
from collections.abc import Callable, Collection
from math import inf
from typing import Any, Protocol, TypeVar, cast

from composer.base.fast_dataclass import dataclass
from composer.model import Node, Port
from composer.runtime.clock.clock import Clock
from composer.runtime.intra_process.publisher import copy_of
from composer.runtime.intra_process.time_limits import Receiver
from composer.testing.tester import Tester

#: Receives a message, and passes on what it likes by the function.
Disturb = Callable[[Any, Callable[[Any], None]], None]
Later = Callable[[float, Callable[[], object]], object]
#: Called before each handler of a node, with its name.
BeforeHandler = Callable[[str], None]
R = TypeVar("R")


@dataclass(slots=True)
class TopicFault:
    """A fault of a topic, for the next ``count`` messages until ``until_s`` (monotonic)."""

    disturb: Disturb
    count: float = inf
    until_s: float = inf


class Faults:
    """The faults of the topics and handlers of a system: :class:`.Instruments` of its host."""

    def __init__(
        self, clock: Clock, ports_of_test: Collection[Port], on_tester: Callable[[Tester], None]
    ) -> None:
        """``on_tester`` is called with the behavior of the test's node."""
        self._clock = clock
        self._on_tester = on_tester
        self._not_disturbed = {id(port) for port in ports_of_test}
        self._topics: dict[str, list[TopicFault]] = {}
        self._handlers: defaultdict[str, list[BeforeHandler]] = defaultdict(list)

    # --- the seams of the runtime

    def receiver(self, port: Port, receiver: R) -> R:
        """Return what receives the messages of a subscription in its place."""
        if id(port) in self._not_disturbed:
            return receiver
        return cast(R, _DisturbedReceiver(cast(Receiver, receiver), self, port.full_name))

    def behavior(self, node: Node, behavior: object) -> None:
        """Let faults act before each handler of a behavior."""
        if isinstance(behavior, Tester):
            self._on_tester(behavior)
            return
        before = self._handlers[node.name.value]
        for name in dir(behavior):
            handler = getattr(behavior, name, None) if name.startswith("on_") else None
            if callable(handler):
                setattr(behavior, name, _with_faults(name, handler, before))

    # --- the verbs of a test

    def add(self, topic: str, fault: TopicFault) -> None:
        """Disturb a topic. Of several faults, the first one that is not over acts."""
        self._topics.setdefault(topic, []).append(fault)

    def end(self, topic: str) -> None:
        """End all faults of a topic."""
        self._topics.pop(topic, None)

    def before_next_handler(self, node: str, handler: str | None, act: Callable[[], None]) -> None:
        """Call ``act()`` once, before the next call of a handler; None for any."""
        waiting = self._handlers[node]

        def before(name: str) -> None:
            if handler in (None, name):
                waiting.remove(before)
                act()

        waiting.append(before)

    def put(self, topic: str, message: Any, receive: Callable[[Any], None]) -> None:
        """Pass a message on, or what the current fault of its topic makes of it."""
        for fault in self._topics.get(topic, ()):
            if fault.count > 0 and self._clock.monotonic() < fault.until_s:
                fault.count -= 1
                fault.disturb(message, receive)
                return
        receive(message)


def drop(_message: Any, _receive: Callable[[Any], None]) -> None:
    """Lose the message."""


def duplicate(message: Any, receive: Callable[[Any], None]) -> None:
    """Deliver the message twice."""
    receive(message)
    receive(message)


def delayed(delay_s: float, later: Later) -> Disturb:
    """Return the fault that delivers messages late."""

    def disturb(message: Any, receive: Callable[[Any], None]) -> None:
        later(delay_s, lambda: receive(message))

    return disturb


def corrupted(change: Callable[[Any], object]) -> Disturb:
    """Return the fault that delivers a copy that ``change`` has modified, or its result."""

    def disturb(message: Any, receive: Callable[[Any], None]) -> None:
        copy = copy_of(message)
        changed = change(copy)
        receive(copy if changed is None else changed)

    return disturb


def reordered() -> Disturb:
    """Return the fault that swaps each two messages."""
    held: dict[Callable[[Any], None], Any] = {}

    def disturb(message: Any, receive: Callable[[Any], None]) -> None:
        if receive in held:
            receive(message)
            receive(held.pop(receive))
        else:
            held[receive] = message

    return disturb


class _DisturbedReceiver:
    """Receives the messages of one subscription."""

    def __init__(self, receiver: Receiver, faults: Faults, topic: str) -> None:
        self._receiver = receiver
        self._faults = faults
        self._topic = topic

    def put(self, message: Any) -> None:
        """Receive the message, from any thread."""
        self._faults.put(self._topic, message, self._receiver.put)

    def close(self) -> None:
        """Receive nothing more."""
        self._receiver.close()


class _Handler(Protocol):
    def __call__(self, *arguments: Any) -> Any: ...


def _with_faults(name: str, handler: _Handler, before: list[BeforeHandler]) -> _Handler:
    @functools.wraps(handler)
    def call(*arguments: Any) -> Any:
        for act in tuple(before):
            act(name)
        return handler(*arguments)

    return call
