from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.context import Context
from rclpy.utilities import get_default_context as get_default_context

class GuardCondition:
    callback: Callable[[], object] | None
    callback_group: CallbackGroup | None
    def __init__(
        self,
        callback: Callable[[], object] | None,
        callback_group: CallbackGroup | None,
        context: Context | None = None,
    ) -> None: ...
    @property
    def handle(self) -> Any: ...
    def trigger(self) -> None: ...
    def destroy(self) -> None: ...
