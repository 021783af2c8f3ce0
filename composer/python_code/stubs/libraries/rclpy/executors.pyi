from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor as ThreadPoolExecutor
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Any, TypeVar, overload

from rclpy._rclpy_pybind11 import InvalidHandle as InvalidHandle
from rclpy.client import Client as Client
from rclpy.clock import Clock as Clock
from rclpy.clock_type import ClockType as ClockType
from rclpy.context import Context as Context
from rclpy.guard_condition import GuardCondition as GuardCondition
from rclpy.node import Node as _Node
from rclpy.service import Service as Service
from rclpy.signals import SignalHandlerGuardCondition as SignalHandlerGuardCondition
from rclpy.subscription import Subscription as Subscription
from rclpy.task import Future as Future
from rclpy.task import Task as Task
from rclpy.timer import Timer as Timer
from rclpy.utilities import get_default_context as get_default_context
from rclpy.utilities import timeout_sec_to_nsec as timeout_sec_to_nsec
from rclpy.waitable import NumberOfEntities as NumberOfEntities
from rclpy.waitable import Waitable as Waitable

_T = TypeVar("_T")

WaitableEntityType = TypeVar("WaitableEntityType")

class TimeoutException(Exception): ...
class ShutdownException(Exception): ...
class ExternalShutdownException(Exception): ...
class ConditionReachedException(Exception): ...

class TimeoutObject:
    timeout: float
    def __init__(self, timeout: float) -> None: ...

async def await_or_execute(callback: Callable[..., Any], *args: Any) -> Any: ...

class Executor(AbstractContextManager["Executor"]):
    _nodes: Any
    _tasks: Any
    _guard: Any
    _is_shutdown: bool
    def __init__(self, *, context: Context | None = None) -> None: ...
    @property
    def context(self) -> Context: ...
    @overload
    def create_task(
        self, callback: Callable[..., Coroutine[Any, Any, _T]], *args: Any, **kwargs: Any
    ) -> Task[_T]: ...
    @overload
    def create_task(
        self, callback: Callable[..., _T] | Coroutine[Any, Any, _T], *args: Any, **kwargs: Any
    ) -> Task[_T]: ...
    def shutdown(self, timeout_sec: float | None = None) -> bool: ...
    def add_node(self, node: _Node) -> bool: ...
    def remove_node(self, node: _Node) -> None: ...
    def wake(self) -> None: ...
    def get_nodes(self) -> list[_Node]: ...
    def spin(self) -> None: ...
    def spin_until_future_complete(
        self, future: Future[Any], timeout_sec: float | None = None
    ) -> None: ...
    def spin_once(self, timeout_sec: float | None = None) -> None: ...
    def spin_once_until_future_complete(
        self, future: Future[Any], timeout_sec: float | TimeoutObject | None = None
    ) -> None: ...
    def can_execute(self, entity: Any) -> bool: ...
    def wait_for_ready_callbacks(self, *args: Any, **kwargs: Any) -> tuple[Any, Any, _Node]: ...
    def __enter__(self) -> Executor: ...
    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None: ...

class SingleThreadedExecutor(Executor): ...

class MultiThreadedExecutor(Executor):
    _futures: Any
    _executor: Any
    def __init__(
        self, num_threads: int | None = None, *, context: Context | None = None
    ) -> None: ...
