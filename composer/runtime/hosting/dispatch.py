"""What rclpy's functions do for hosted nodes: decided by the type of the node they are given.

Installed once per process, before the first class is imported. Other nodes are not affected.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from functools import cache, wraps
from typing import Any

import rclpy
from rclpy import utilities
from rclpy import wait_for_message as waiting
from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.executors import Executor, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.lifecycle.node import LifecycleNodeMixin
from rclpy.node import Node

from composer.model import PortKind
from composer.runtime.executors.tracebacks import is_internal
from composer.runtime.hosting import adopted_node
from composer.runtime.hosting.adopted_node import AdoptedLifecycleNode, AdoptedNode
from composer.runtime.hosting.declared_ports import HostingError
from composer.runtime.hosting.instance import Instance
from composer.runtime.hosting.user_code import current_instance, on_thread_start
from composer.runtime.ros.messages import load_type_support

_SECOND_NODE = (
    "the class creates a second node, {name}; declare it as a node of the system,"
    " or run the class as an 'executable'"
)
_SPINS = (
    "the class spins its node in {where}, which would never return: the composer calls its"
    " callbacks; remove the spin, or run the class as an 'executable'"
)


@cache
def install() -> None:
    """Let rclpy's functions dispatch by the type of their node."""
    _install_nodes()
    _install_action(ActionServer, PortKind.ACTION_SERVER)
    _install_action(ActionClient, PortKind.ACTION_CLIENT)
    _install_spinning()
    _install_executors()
    _install_waiting()
    _install_threads()
    _install_context()
    _install_signals()


def _install_nodes() -> None:
    create_node, create_mixin = Node.__init__, LifecycleNodeMixin.__init__

    @wraps(create_node)
    def init_node(self: Any, *arguments: Any, **options: Any) -> None:
        if isinstance(self, AdoptedNode):  # Node.__init__(self, 'name') instead of super()
            AdoptedNode.__init__(self, *arguments, **options)
            return
        if current_instance() is not None:
            name = arguments[0] if arguments else options.get("node_name")
            raise HostingError(_SECOND_NODE.format(name=f"'{name}'"))
        create_node(self, *arguments, **options)

    @wraps(create_mixin)
    def init_mixin(self: Any, **options: Any) -> None:
        if isinstance(self, AdoptedLifecycleNode):
            self.take_over_lifecycle()
        else:
            create_mixin(self, **options)

    Node.__init__ = init_node  # type: ignore[method-assign]
    LifecycleNodeMixin.__init__ = init_mixin  # type: ignore[method-assign]


def _install_action(kind: Any, role: PortKind) -> None:
    create = kind.__init__

    @wraps(create)
    def init(
        self: Any, node: Any, action_type: Any, action_name: str, *args: Any, **options: Any
    ) -> None:
        if not isinstance(node, AdoptedNode):
            create(self, node, action_type, action_name, *args, **options)
            return
        load_type_support(action_type)
        full_name = adopted_node.action_name(node, role, action_name)
        create(self, node, action_type, full_name, *args, **options)
        node.adopt_action(self, full_name)

    kind.__init__ = init


def _install_spinning() -> None:
    spin, spin_once = rclpy.spin, rclpy.spin_once
    spin_until_complete = rclpy.spin_until_future_complete

    def spin_node(node: Any, executor: Any = None) -> None:
        if isinstance(node, AdoptedNode):
            _wait_until_ended(node._composer_instance)
        else:
            spin(node, executor)

    def spin_node_once(node: Any, *, executor: Any = None, timeout_sec: Any = None) -> None:
        if isinstance(node, AdoptedNode):
            node._composer_instance.spin_once(timeout_sec)
        else:
            spin_once(node, executor=executor, timeout_sec=timeout_sec)

    def spin_node_until_complete(
        node: Any, future: Any, executor: Any = None, timeout_sec: Any = None
    ) -> None:
        if isinstance(node, AdoptedNode):
            node._composer_instance.spin(future, timeout_sec)
        else:
            spin_until_complete(node, future, executor, timeout_sec)

    rclpy.spin = spin_node
    rclpy.spin_once = spin_node_once
    rclpy.spin_until_future_complete = spin_node_until_complete


def _install_executors() -> None:
    add_node, spin_until_complete = Executor.add_node, Executor.spin_until_future_complete

    def add_node_to_executor(self: Any, node: Any) -> bool:
        if not isinstance(node, AdoptedNode):
            return add_node(self, node)
        node._composer_instance.executors.append(self)
        return True  # and do not serve it: the composer does

    def executor_spins_until(self: Any, future: Any, timeout_sec: Any = None) -> None:
        instance = current_instance()
        if instance is not None and self in instance.executors:
            instance.spin(future, timeout_sec)
        else:
            spin_until_complete(self, future, timeout_sec)

    Executor.add_node = add_node_to_executor  # type: ignore[method-assign]
    Executor.spin_until_future_complete = executor_spins_until  # type: ignore[method-assign]
    for kind in (SingleThreadedExecutor, MultiThreadedExecutor):
        _install_spin_once(kind)


def _install_spin_once(kind: Any) -> None:
    spin_once = kind.spin_once

    @wraps(spin_once)
    def executor_spins_once(self: Any, timeout_sec: Any = None) -> None:
        instance = current_instance()
        if instance is not None and self in instance.executors:
            instance.spin_once(timeout_sec)
        else:
            spin_once(self, timeout_sec)

    kind.spin_once = executor_spins_once


def _install_waiting() -> None:
    wait: Any = waiting.wait_for_message

    @wraps(wait)
    def wait_for_message(
        msg_type: Any, node: Any, topic: str, *, qos_profile: Any = 1, time_to_wait: float = -1
    ) -> Any:
        if isinstance(node, AdoptedNode):
            return node.wait_for_message(msg_type, topic, qos_profile, time_to_wait)
        return wait(msg_type, node, topic, qos_profile=qos_profile, time_to_wait=time_to_wait)

    waiting.wait_for_message = wait_for_message


def _install_threads() -> None:
    start = threading.Thread.start

    def start_thread(self: threading.Thread) -> None:
        if not is_internal(sys._getframe(1).f_code.co_filename):  # of the composer's own
            on_thread_start(self)
        start(self)

    threading.Thread.start = start_thread  # type: ignore[method-assign]


def _install_signals() -> None:
    set_handler: Any = signal.signal

    @wraps(set_handler)
    def set_handler_of_class(number: int, handler: Any) -> Any:
        instance = current_instance()
        if instance is None or number not in (signal.SIGINT, signal.SIGTERM):
            return set_handler(number, handler)
        before = instance.signal_handlers.get(number, signal.SIG_DFL)
        instance.signal_handlers[number] = handler
        return before

    signal.signal = set_handler_of_class  # type: ignore[assignment]


def _wait_until_ended(instance: Instance) -> None:
    """Let a thread of the class wait while the composer calls the callbacks."""
    in_transition = threading.current_thread() is instance.transition_thread
    if in_transition or instance.context.loop.is_current():
        where = "its constructor or a transition" if in_transition else "a callback"
        raise HostingError(_SPINS.format(where=where))
    instance.ended.wait()


def _install_context() -> None:
    init, is_ok = rclpy.init, utilities.ok

    def ok(**options: Any) -> bool:
        # Threads of classes loop while it is true.
        instance = current_instance()
        return not (instance is not None and instance.ended.is_set()) and bool(is_ok(**options))

    def init_context(**options: Any) -> Any:
        # It is initialized already.
        return init(**options) if current_instance() is None else contextlib.nullcontext()

    def finishing(shutdown: Any, name: str) -> Any:
        def shut_down(**options: Any) -> None:
            instance = current_instance()
            if instance is None:
                shutdown(**options)
            else:
                instance.settings.finish(f"it called rclpy.{name}()")

        return shut_down

    rclpy.init = init_context
    rclpy.shutdown = finishing(rclpy.shutdown, "shutdown")
    # rclpy imports these two without declaring them as its own.
    rclpy.ok = ok  # type: ignore[attr-defined]
    rclpy.try_shutdown = finishing(utilities.try_shutdown, "try_shutdown")  # type: ignore[attr-defined]
