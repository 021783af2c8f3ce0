"""What virtual time asks of a system: all of it in this process, and on one clock that advances.

Some functions have the time or the random numbers of the computer. Code of an rclpy class gets the
time of the run from them: such a class is run unmodified. For behaviors, each place is named once,
with what to use instead. Calls of libraries are neither.
"""

from __future__ import annotations

import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import wraps
from pkgutil import resolve_name
from types import FrameType
from typing import Any

from rclpy.clock_type import ClockType
from rclpy.time import Time

from composer.base.fast_dataclass import dataclass
from composer.model import Node, System
from composer.runtime.clock import COMPUTER, Clock, VirtualClock
from composer.runtime.executors.tracebacks import is_internal, is_library, location_of, outward
from composer.runtime.hosting.dispatch import install
from composer.runtime.hosting.instance import Instance
from composer.runtime.hosting.user_code import current_instance
from composer.runtime.intra_process.router import shared_channels
from composer.runtime.node.interruption import RunningCallback, running_callbacks
from composer.runtime.process import StartRefused
from composer.runtime.supervision.node_set import NodeSet

#: Nothing outside of the process takes part in a run.
ISOLATION = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}
_MAX_REASONS = 5
#: Of the signals of a standstill at one point in time, the one at which calls begin to be counted,
#: and the one that ends the system: after 300 000 reads of the clock.
_COUNTS_FROM = 50
_ENDS_AT = 100
_MAX_CALLBACKS = 5
#: How often the turn is looked at, in seconds of real time.
LOOK_S = 1.0
#: The number of looks after which a callback is named, and after which it may be interrupted.
_NAMED_AFTER, _INTERRUPTED_AFTER = 10, 2
#: The number of looks after which a callback ends the run that has used no more CPU time between
#: two looks.
_ENDED_AFTER, _IDLE_S = 60, 0.01
#: Code of debuggers, which wait for the user.
_DEBUGGERS = ("bdb.py", "pydevd.py")
_NANOSECONDS = 1_000_000_000
_FUTURE = "'await' on a future"
_NOW = "self.clock.now()"
_SLEEP = "await self.clock.sleep(seconds)"


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


@dataclass(frozen=True, slots=True)
class _Outside:
    """A function that is not of virtual time, and what to use instead.

    If libraries call it for user code, it is a call of the user code (``walks``). ``replacement``
    gets the instance of the class that calls it, and the arguments.
    """

    name: str
    use: str
    shown: str = ""
    walks: bool = False
    replacement: Callable[..., Any] | None = None

    def applies(self, arguments: tuple[Any, ...], options: dict[str, Any]) -> bool:
        """Return whether a call is outside: generators may have a seed, clocks the node's time."""
        if self.name == "rclpy.clock.Clock.now":
            return bool(arguments[0].clock_type != ClockType.ROS_TIME)
        if self.name != "random.Random.seed":
            return True
        return (arguments[1] if len(arguments) > 1 else options.get("a")) is None


def _clock(instance: Instance) -> Clock:
    return instance.context.loop.clock


def _monotonic_ns(instance: Instance) -> int:
    return round(_clock(instance).monotonic() * _NANOSECONDS)


def _now(instance: Instance, clock: Any) -> Time:
    """Return the time of a clock of rclpy."""
    is_steady = clock.clock_type == ClockType.STEADY_TIME
    now_ns = _monotonic_ns(instance) if is_steady else _clock(instance).time_ns()
    return Time(nanoseconds=now_ns, clock_type=clock.clock_type)


def _sleep_until(instance: Instance, clock: Any, until: Time, _context: object = None) -> bool:
    instance.sleep((until - _now(instance, clock)).nanoseconds / _NANOSECONDS)
    return True


def _wait(instance: Instance, event: threading.Event, timeout: float | None = None) -> bool:
    return event.is_set() or instance.wait(event, timeout)


_OUTSIDE = (
    _Outside("time.time", _NOW, replacement=lambda instance: _clock(instance).time()),
    _Outside("time.time_ns", _NOW, replacement=lambda instance: _clock(instance).time_ns()),
    *(
        _Outside(f"time.{name}", _NOW, replacement=lambda instance: _clock(instance).monotonic())
        for name in ("monotonic", "perf_counter")
    ),
    *(
        _Outside(f"time.{name}_ns", _NOW, replacement=_monotonic_ns)
        for name in ("monotonic", "perf_counter")
    ),
    _Outside("time.sleep", _SLEEP, replacement=Instance.sleep),
    _Outside("threading.Event.wait", _FUTURE, replacement=_wait),
    _Outside("rclpy.clock.Clock.now", _NOW, walks=True, replacement=_now),
    _Outside("rclpy.clock.Clock.sleep_until", _SLEEP, walks=True, replacement=_sleep_until),
    _Outside("os.urandom", "random.randbytes(size)"),
    *(
        _Outside(f"uuid.{name}", "uuid.UUID(int=random.getrandbits(128), version=4)")
        for name in ("uuid1", "uuid4")
    ),
    _Outside("random.Random.seed", "random.Random(seed)", "random.Random", walks=True),
    _Outside("threading.Thread.start", "timers, or 'async def' handlers", "a thread", walks=True),
    _Outside("socket.socket.__init__", "a stand-in for this node", "a socket", walks=True),
    _Outside("subprocess.Popen.__init__", "a stand-in for this node", "a process", walks=True),
)


@contextmanager
def outside_calls(report: Callable[[str], None]) -> Iterator[None]:
    """Context manager: report once each place of user code that does not use virtual time.

    Modules that were imported before, and have names of their own for these functions, are not
    noticed, nor is code in C.
    """
    install()  # it replaces Thread.start as well, for good
    places: set[tuple[str, str]] = set()
    with ExitStack() as stack:
        for outside in _OUTSIDE:
            owner_name, _, attribute = outside.name.rpartition(".")
            owner: Any = resolve_name(owner_name)
            original = getattr(owner, attribute)
            stack.callback(setattr, owner, attribute, original)
            setattr(owner, attribute, _watched(original, outside, places, report))
        yield


def _watched(
    function: Callable[..., Any],
    outside: _Outside,
    places: set[tuple[str, str]],
    report: Callable[[str], None],
) -> Callable[..., Any]:
    @wraps(function)
    def call(*arguments: Any, **options: Any) -> Any:
        frame = sys._getframe(1)
        place = _user_place(frame, walks=outside.walks)
        if outside.replacement is not None:
            instance = current_instance()
            package = "" if instance is None else instance.settings.package
            if package and (place or outside.walks or _package(frame) == package):
                return outside.replacement(instance, *arguments, **options)
        is_new = bool(place) and (place, outside.name) not in places
        if is_new and _is_callback(frame) and outside.applies(arguments, options):
            places.add((place, outside.name))
            shown = outside.shown or f"{outside.name}()"
            report(f"{place} uses {shown}, which virtual time does not control; use {outside.use}")
        return function(*arguments, **options)

    return call


def _user_place(frame: FrameType | None, *, walks: bool) -> str:
    """Return ``file:line`` of a frame if it is user code, which may call libraries (``walks``)."""
    while walks and frame is not None and is_library(frame.f_code.co_filename):
        frame = frame.f_back
    path = "" if frame is None else frame.f_code.co_filename
    is_user_code = frame is not None and not (is_library(path) or is_internal(path))
    return f"{path}:{frame.f_lineno}" if frame is not None and is_user_code else ""


def _package(frame: FrameType) -> str:
    """Return the top-level package of the code of a frame."""
    return str(frame.f_globals.get("__name__", "")).partition(".")[0]


def _is_callback(frame: FrameType) -> bool:
    """Return whether the composer has called the code; a test of pytest is not of the system."""
    return any(is_internal(caller.f_code.co_filename) for caller in outward(frame))
