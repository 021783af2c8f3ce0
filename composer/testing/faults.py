"""Faults that a test injects: messages that get lost or late, late timers, handlers that raise."""

from __future__ import annotations

import functools
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Mapping
from dataclasses import field
from functools import partial
from typing import Any, Protocol, TypedDict, TypeVar, cast

from composer.base.fast_dataclass import dataclass
from composer.model import Node, Port
from composer.runtime.clock import Clock
from composer.runtime.intra_process.publisher import copy_of
from composer.runtime.intra_process.topic import Receiver
from composer.testing.tester import Tester

#: Receives a message, and passes on what it likes by the function.
Disturb = Callable[[Any, Callable[[Any], None]], None]
Later = Callable[[float, Callable[[], object]], object]
#: Called before each handler of a node, with its name.
BeforeHandler = Callable[[str], None]
R = TypeVar("R")


class Limits(TypedDict, total=False):
    """What a fault of a topic or a timer acts on, by default on all messages or calls.

    The next ``count`` after ``skip`` others, for at most ``for_s`` seconds.
    """

    skip: int
    count: float
    for_s: float


@dataclass(slots=True)
class Fault:
    """A fault of a topic, for each of its subscriptions, or of a timer; see :class:`Limits`.

    It ends at ``until_s`` (monotonic).
    """

    disturb: Disturb
    skip: int
    count: float
    until_s: float
    #: How many messages had come before, by subscription.
    before: Counter[object] = field(default_factory=Counter)


class Faults:
    """The faults of topics, timers and handlers of a system: :class:`.Instruments` of its host."""

    def __init__(
        self, clock: Clock, ports_of_test: Collection[Port], on_tester: Callable[[Tester], None]
    ) -> None:
        """``on_tester`` is called with the behavior of the test's node."""
        self._clock = clock
        self._on_tester = on_tester
        self._not_disturbed = {id(port) for port in ports_of_test}
        self._faults: dict[str, list[Fault]] = {}
        self._seen: defaultdict[str, Counter[object]] = defaultdict(Counter)
        self._handlers: defaultdict[str, list[BeforeHandler]] = defaultdict(list)
        self._handler_names: defaultdict[str, dict[str, None]] = defaultdict(dict)

    # --- the seams of the runtime

    def receiver(self, port: Port, receiver: R) -> R:
        """Return what receives the messages of a subscription in its place."""
        if id(port) in self._not_disturbed:
            return receiver
        return cast(R, _DisturbedReceiver(cast(Receiver, receiver), self, port))

    def timer(self, node: str, timer: str, tick: Callable[[], None]) -> Callable[[], None]:
        """Return what a timer calls in the place of ``tick``."""

        def receive(_: None) -> None:
            tick()

        return partial(self.put, timer_name(node, timer), None, None, receive)

    def behavior(self, node: Node, behavior: object) -> None:
        """Let faults act before each handler of a behavior."""
        if isinstance(behavior, Tester):
            self._on_tester(behavior)
            return
        for name in dir(behavior):
            handler = getattr(behavior, name, None) if name.startswith("on_") else None
            if callable(handler):
                setattr(behavior, name, self.callback(node.full_name, name, handler))

    def callback(self, node: str, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that lets faults act before each call of a handler or callback."""
        self._handler_names[node][name] = None
        return _with_faults(name, function, self._handlers[node])

    # --- the verbs of a test

    def add(self, name: str, fault: Fault) -> None:
        """Disturb a topic or a timer. Of several faults of a message, the first one acts."""
        fault.before = self._seen[name].copy()
        self._faults.setdefault(name, []).append(fault)

    def end(self, name: str) -> None:
        """End all faults of a topic or a timer."""
        self._faults.pop(name, None)

    @property
    def seen(self) -> Mapping[str, int]:
        """How many messages or calls have come so far, by topic or timer."""
        return {name: max(counts.values(), default=0) for name, counts in self._seen.items()}

    def handlers(self, node: str) -> Collection[str]:
        """Return the handlers and callbacks that a node (its full name) has had so far."""
        return self._handler_names[node]

    def before_next_handler(self, node: str, handler: str | None, act: Callable[[], None]) -> None:
        """Call ``act()`` once, before the next call of a handler; None for any."""
        waiting = self._handlers[node]

        def before(name: str) -> None:
            if handler in (None, name):
                waiting.remove(before)
                act()

        waiting.append(before)

    def put(self, name: str, end: object, message: Any, receive: Callable[[Any], None]) -> None:
        """Pass on a message for a subscription (``end``), or what a fault makes of it."""
        seen = self._seen[name]
        seen[end] += 1
        for fault in self._faults.get(name, ()):
            number = seen[end] - fault.before[end] - fault.skip
            if 0 < number <= fault.count and self._clock.monotonic() < fault.until_s:
                fault.disturb(message, receive)
                return
        receive(message)


def timer_name(node: str, timer: str) -> str:
    """Return the name of a timer among the faults; ``node`` is a full name."""
    return f"{node}.{timer}"


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

    def __init__(self, receiver: Receiver, faults: Faults, port: Port) -> None:
        self._receiver = receiver
        self._put = partial(faults.put, port.full_name, id(port))

    def put(self, message: Any) -> None:
        """Receive the message, from any thread."""
        self._put(message, self._receiver.put)

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
