"""What virtual time asks of a system: all of it in this process, and on one clock that advances."""

from __future__ import annotations

import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from composer.model import Node, System
from composer.runtime.clock import COMPUTER, VirtualClock
from composer.runtime.executors.tracebacks import is_library, location_of, outward
from composer.runtime.intra_process.router import shared_channels
from composer.runtime.node.interruption import RunningCallback, running_callbacks
from composer.runtime.process import StartRefused
from composer.runtime.supervision.node_set import NodeSet
from composer.runtime.supervision.outside_calls import outside_calls

#: Nothing outside of the process takes part in a run.
ISOLATION = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}
_MAX_REASONS = 5


def check_virtual_time(system: System) -> None:
    """Raise StartRefused if a part of the system cannot run in virtual time."""
    reasons = list(_reasons(system))
    if not reasons:
        return
    more = f"; and {len(reasons) - _MAX_REASONS} more" * (len(reasons) > _MAX_REASONS)
    raise StartRefused(
        f"{system.name} cannot run in virtual time: {'; '.join(reasons[:_MAX_REASONS])}{more}",
        "run it in real time, without '--time virtual'",
    )


def _reasons(system: System) -> Iterator[str]:
    for node in system.nodes:
        kind = _kind_outside(node)
        if kind is not None:
            yield f"{node.full_name} {kind}, which has the time of the computer"
    for (kind, name), reason in shared_channels(system, in_virtual_time=True).items():
        if reason is not None:
            yield f"{kind.value} {name} needs the middleware: {reason}"


def _kind_outside(node: Node) -> str | None:
    if node.process is not None:
        return f"runs in process '{node.process}'"
    if node.external is not None:
        return "is an external node"
    if node.executable is not None:
        return "is an executable"
    if node.component is not None:
        return "is a component"
    return None


#: Of the signals of a standstill at one point in time, the one at which calls begin to be counted,
#: and the one that ends the system: after 300 000 reads of the clock.
_COUNTS_FROM = 50
_ENDS_AT = 100
_MAX_CALLBACKS = 5


class Standstill:
    """Ends a system whose time does not advance, because callbacks cause each other without end."""

    def __init__(self, clock: VirtualClock, node_set: NodeSet, fail: Callable[[str], None]) -> None:
        """``fail(text)`` ends the run; the text names the callbacks."""
        self._clock = clock
        self._node_set = node_set
        self._fail = fail
        self._at_ns = -1
        self._signals = 0
        self._calls: Counter[str] = Counter()
        self._places: set[str] = set()
        clock.on_standstill = self._on_signal

    def _on_signal(self) -> None:
        now_ns = self._clock.time_ns()
        if now_ns != self._at_ns:
            self._at_ns, self._signals = now_ns, 0
        self._signals += 1
        if self._signals == _COUNTS_FROM:
            self._calls = self._count_calls()
            self._places.clear()
        elif self._signals > _COUNTS_FROM:
            place = location_of(outward(sys._getframe(1)))
            if place and not is_library(place):  # the loop itself is called by such code
                self._places.add(place)
        if self._signals == _ENDS_AT:
            self._clock.creep()
            self._fail(f"the time does not advance, because {self._cause()}")

    def _count_calls(self) -> Counter[str]:
        return Counter(
            {
                f"{each.node} {each.kind} '{each.name}'": each.count
                for each in self._node_set.callbacks()
            }
        )

    def _cause(self) -> str:
        calls = self._count_calls() - self._calls
        if calls:
            busiest = sorted(calls.items(), key=lambda item: (-item[1], item[0]))[:_MAX_CALLBACKS]
            names = ", ".join(f"{name} ({count} calls)" for name, count in busiest)
            return f"callbacks cause each other without end: {names}"
        places = ", ".join(sorted(self._places)[:_MAX_CALLBACKS])
        return f"a callback goes on without waiting{' at ' + places if places else ''}"


#: How often the turn is looked at, in seconds of real time.
LOOK_S = 1.0
#: The number of looks after which a callback is named, and after which it may be interrupted.
_NAMED_AFTER, _INTERRUPTED_AFTER = 10, 2
#: The number of looks after which a callback ends the run that has used no more CPU time between
#: two looks.
_ENDED_AFTER, _IDLE_S = 60, 0.01
#: Code of debuggers, which wait for the user.
_DEBUGGERS = ("bdb.py", "pydevd.py")


class TurnWatch:
    """Names callbacks that do not return, and so keep the turn: no time passes meanwhile.

    It looks at them in real time, on a thread that is not of the system. They may compute something
    long, so it interrupts them only once the system stops. One that waits, such as for a lock,
    cannot be interrupted. If it waits for a minute, it loses the turn, and the run ends.
    """

    def __init__(
        self,
        clock: VirtualClock,
        is_stopping: Callable[[], bool],
        warn: Callable[[str], None],
        fail: Callable[[str], None],
    ) -> None:
        self._clock = clock
        self._is_stopping = is_stopping
        self._warn = warn
        self._fail = fail
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="turn watch", daemon=True)

    def __enter__(self) -> None:
        """Start to look."""
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        """Look no more."""
        self._end.set()
        self._thread.join()

    def _run(self) -> None:
        turns = looks = idle_looks = 0
        cpu_s = 0.0
        while not COMPUTER.wait(self._end, LOOK_S):
            looks = looks + 1 if turns == self._clock.turns else 0
            turns = self._clock.turns
            before_s, cpu_s = cpu_s, COMPUTER.cpu_s(self._clock.running_thread)
            idle_looks = idle_looks + 1 if looks and cpu_s - before_s < _IDLE_S else 0
            if idle_looks == _ENDED_AFTER:
                self._end_waiting()
            is_over = self._is_stopping() and looks >= _INTERRUPTED_AFTER
            for callback in self._callbacks() if is_over or looks == _NAMED_AFTER else ():
                at = callback.location()
                if is_over:
                    self._warn(f"{callback.name} is interrupted; it is at {at}")
                    callback.interrupt()
                else:
                    lasts = f"{callback.name} has not returned for {looks * LOOK_S:g} s"
                    self._warn(f"{lasts}, in which the time does not advance; it is at {at}")

    def _end_waiting(self) -> None:
        for callback in self._callbacks():
            if not any(name in callback.stack() for name in _DEBUGGERS):
                self._fail(
                    f"the time does not advance, because {callback.name} waits at"
                    f" {callback.location()} for something that virtual time does not control"
                )
                self._clock.pass_turn_on()

    def _callbacks(self) -> list[RunningCallback]:
        return [stack[0] for stack in running_callbacks((self._clock.running_thread,))]


@contextmanager
def watched_time(
    clock: VirtualClock,
    node_set: NodeSet,
    is_stopping: Callable[[], bool],
    warn: Callable[[str], None],
    fail: Callable[[str], None],
) -> Iterator[None]:
    """Context manager: report what keeps the time of a run from advancing or being the same.

    ``warn`` receives what may be meant, ``fail`` what has to end the run.
    """
    Standstill(clock, node_set, fail)
    with outside_calls(warn), TurnWatch(clock, is_stopping, warn, fail):
        yield
