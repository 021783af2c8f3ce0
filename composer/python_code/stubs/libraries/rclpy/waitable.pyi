from types import TracebackType
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.task import Future

class NumberOfEntities:
    num_subscriptions: int
    num_guard_conditions: int
    num_timers: int
    num_clients: int
    num_services: int
    num_events: int
    def __init__(
        self,
        num_subs: int = 0,
        num_gcs: int = 0,
        num_timers: int = 0,
        num_clients: int = 0,
        num_services: int = 0,
        num_events: int = 0,
    ) -> None: ...
    def __add__(self, other: NumberOfEntities) -> NumberOfEntities: ...

class Waitable:
    callback_group: CallbackGroup
    def __init__(self, callback_group: CallbackGroup) -> None: ...
    def __enter__(self) -> Any: ...
    def __exit__(
        self,
        t: type[BaseException] | None,
        v: BaseException | None,
        tb: TracebackType | None,
    ) -> None: ...
    def add_future(self, future: Future[Any]) -> None: ...
    def remove_future(self, future: Future[Any]) -> None: ...
    def is_ready(self, wait_set: Any) -> bool: ...
    def take_data(self) -> Any: ...
    async def execute(self, taken_data: Any) -> None: ...
    def get_num_entities(self) -> NumberOfEntities: ...
    def add_to_wait_set(self, wait_set: Any) -> None: ...
