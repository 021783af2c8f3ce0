"""Whether the ROS graph has changed, without queries while it has not."""

from __future__ import annotations

import ctypes
import threading
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.waitable import NumberOfEntities, Waitable

# What rclpy lacks. rclpy has loaded librcl of the ROS installation in use.
_RCL = ctypes.CDLL("librcl.so")
_guard_condition_of = _RCL.rcl_node_get_graph_guard_condition
_guard_condition_of.argtypes = [ctypes.c_void_p]
_guard_condition_of.restype = ctypes.c_void_p
_add_guard_condition = _RCL.rcl_wait_set_add_guard_condition
_add_guard_condition.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.POINTER(ctypes.c_size_t)]
_add_guard_condition.restype = ctypes.c_int


class GraphChanges(Waitable):
    """Counts the changes of the ROS graph, as a node with an executor discovers them.

    rcl triggers a guard condition at each change. After one, the executor does not wait for the
    next until :meth:`number` is called: discovery, with its thousands of changes, does not keep it
    busy.
    """

    def __init__(self, node: Node) -> None:
        super().__init__(node.default_callback_group)
        self._node = node
        self._number = 0
        self._has_changed = True
        self._index: int | None = None
        node.add_waitable(self)

    def number(self) -> int:
        """Return another number than the last time if the graph may have changed since then."""
        if self._has_changed:
            self._has_changed = False
            self._number += 1
            if self._node.executor is not None:
                self._node.executor.wake()
        return self._number

    def __enter__(self) -> None:
        """Postpone the destruction of the node while the executor waits."""
        self._node.handle.__enter__()

    def __exit__(self, *exception: object) -> None:
        """Let the node be destroyed."""
        self._node.handle.__exit__(*exception)

    def get_num_entities(self) -> NumberOfEntities:
        """Return the number of entities to wait for."""
        return NumberOfEntities(0, 1)  # no subscription, one guard condition

    def add_to_wait_set(self, wait_set: Any) -> None:
        """Wait for the next change."""
        self._index = None
        if not self._has_changed:
            self._index = _add_to(wait_set, self._node)

    def is_ready(self, wait_set: Any) -> bool:
        """Return whether there was a change."""
        return self._index is not None and wait_set.is_ready("guard_condition", self._index)

    def take_data(self) -> bool:
        """Note the change, before the executor waits again."""
        self._has_changed = True
        return True

    async def execute(self, _: Any) -> None:
        """Do nothing more."""


class PolledGraphChanges:
    """Counts the changes of the ROS graph without an executor, for rare queries of any thread.

    A context can have only one of these: each call resets its guard condition.
    """

    def __init__(self, node: Node) -> None:
        #: The node whose view of the graph it is.
        self.node = node
        self._wait_set = rclpy_implementation.WaitSet(0, 1, 0, 0, 0, 0, node.context.handle)
        self._number = 0
        self._looking = threading.Lock()

    def number(self) -> int:
        """Return another number than the last time if the graph may have changed since then."""
        with self._looking, self.node.handle:
            self._wait_set.clear_entities()
            index = _add_to(self._wait_set, self.node)
            self._wait_set.wait(0)
            if index is None or self._wait_set.is_ready("guard_condition", index):
                self._number += 1
            return self._number


def _add_to(wait_set: Any, node: Node) -> int | None:
    """Add the guard condition of the graph to a wait set; return its index, None if refused."""
    index = ctypes.c_size_t()
    condition = _guard_condition_of(node.handle.pointer)
    is_added = _add_guard_condition(wait_set.pointer, condition, ctypes.byref(index)) == 0
    return index.value if is_added else None
