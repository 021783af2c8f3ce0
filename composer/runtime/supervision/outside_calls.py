"""Functions that have the time or the random numbers of the computer, in a run in virtual time.

Code of an rclpy class gets the time of the run from them: such a class is run unmodified. For
behaviors, each place is named once, with what to use instead. Calls of libraries are neither.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import wraps
from pkgutil import resolve_name
from types import FrameType
from typing import Any

from rclpy.clock_type import ClockType
from rclpy.time import Time

from composer.base.fast_dataclass import dataclass
from composer.runtime.clock import Clock
from composer.runtime.executors.tracebacks import is_internal, is_library, outward
from composer.runtime.hosting.dispatch import install
from composer.runtime.hosting.instance import Instance
from composer.runtime.hosting.user_code import current_instance

_NANOSECONDS = 1_000_000_000


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


_FUTURE = "'await' on a future"
_NOW = "self.clock.now()"
_SLEEP = "await self.clock.sleep(seconds)"
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
