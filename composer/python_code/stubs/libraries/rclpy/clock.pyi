from collections.abc import Callable
from enum import IntEnum
from types import TracebackType
from typing import Any, TypedDict

from rclpy.clock_type import ClockType as ClockType
from rclpy.context import Context as Context
from rclpy.destroyable import DestroyableType as DestroyableType
from rclpy.duration import Duration as Duration
from rclpy.exceptions import NotInitializedException as NotInitializedException
from rclpy.time import Time as Time
from rclpy.time import TimeHandle as TimeHandle
from rclpy.utilities import get_default_context as get_default_context

class ClockChange(IntEnum):
    ROS_TIME_NO_CHANGE = 1
    ROS_TIME_ACTIVATED = 2
    ROS_TIME_DEACTIVATED = 3
    SYSTEM_TIME_NO_CHANGE = 4

class JumpThreshold:
    min_forward: Duration | None
    min_backward: Duration | None
    on_clock_change: bool
    def __init__(
        self,
        *,
        min_forward: Duration | None,
        min_backward: Duration | None,
        on_clock_change: bool = True,
    ) -> None: ...

class TimeJump:
    def __init__(self, clock_change: ClockChange, delta: Duration) -> None: ...
    @property
    def clock_change(self) -> ClockChange: ...
    @property
    def delta(self) -> Duration: ...

class TimeJumpDictionary(TypedDict):
    clock_change: ClockChange
    delta: int

JumpHandlePreCallbackType = Callable[[], object]
ClockHandle = Any

class JumpHandle:
    def __init__(
        self,
        *,
        clock: Clock,
        threshold: JumpThreshold,
        pre_callback: Callable[[], object] | None,
        post_callback: Callable[[TimeJumpDictionary], object] | None,
    ) -> None: ...
    def unregister(self) -> None: ...
    def __enter__(self) -> JumpHandle: ...
    def __exit__(
        self,
        t: type[BaseException] | None,
        v: BaseException | None,
        tb: TracebackType | None,
    ) -> None: ...

class Clock:
    def __new__(cls, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> Clock: ...
    @property
    def clock_type(self) -> ClockType: ...
    @property
    def handle(self) -> Any: ...
    def now(self) -> Time: ...
    # rclpy is annotated with `TimeJump`, and passes the dictionary.
    def create_jump_callback(
        self,
        threshold: JumpThreshold,
        *,
        pre_callback: Callable[[], object] | None = None,
        post_callback: Callable[[Any], object] | None = None,
    ) -> JumpHandle: ...
    def sleep_until(self, until: Time, context: Context | None = None) -> bool: ...
    def sleep_for(self, rel_time: Duration, context: Context | None = None) -> bool: ...

class ROSClock(Clock):
    def __new__(cls) -> ROSClock: ...
    @property
    def ros_time_is_active(self) -> bool: ...
    def set_ros_time_override(self, time: Time) -> None: ...
