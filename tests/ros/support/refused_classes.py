"""Classes that cannot be hosted, written for the tests."""

from __future__ import annotations

import time
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.waitable import Waitable


class SpinsInConstructor(Node):
    def __init__(self) -> None:
        super().__init__("spins")
        rclpy.spin(self)


class MakesSecondNode(Node):
    def __init__(self) -> None:
        super().__init__("first")
        self.helper = rclpy.create_node("helper")


class HasOwnArguments(Node):
    def __init__(self) -> None:
        super().__init__("own", cli_args=["--ros-args", "-r", "a:=b"])


class HasOwnContext(Node):
    def __init__(self) -> None:
        super().__init__("own", context=Context())


class CallsInitTwice(Node):
    def __init__(self) -> None:
        super().__init__("one")
        super().__init__("two")


class NeverReturns(Node):
    def __init__(self) -> None:
        super().__init__("slow")
        while True:
            time.sleep(0.001)


class Exits(Node):
    def __init__(self) -> None:
        super().__init__("exits")
        raise SystemExit(3)


class HasWaitable(Node):
    def __init__(self) -> None:
        super().__init__("waitable")
        self.add_waitable(Waitable(self.default_callback_group))


class WantsArguments(Node):
    def __init__(self, port: Any) -> None:
        super().__init__("wants")


class NotANode:
    pass
