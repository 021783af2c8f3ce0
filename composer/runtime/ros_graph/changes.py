"""Whether the ROS graph has changed, without queries while it has not."""

from __future__ import annotations

import ctypes
import threading

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

# What rclpy lacks. rclpy has loaded librcl of the ROS installation in use.
_RCL = ctypes.CDLL("librcl.so")
_guard_condition_of = _RCL.rcl_node_get_graph_guard_condition
_guard_condition_of.argtypes = [ctypes.c_void_p]
_guard_condition_of.restype = ctypes.c_void_p
_add_guard_condition = _RCL.rcl_wait_set_add_guard_condition
_add_guard_condition.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.POINTER(ctypes.c_size_t)]
_add_guard_condition.restype = ctypes.c_int


class GraphChanges:
    """Counts the changes of the ROS graph, for rare queries of any thread.

    rcl triggers a guard condition at each change. A context can have only one of these: each call
    resets that condition.
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
            index = ctypes.c_size_t()
            condition = _guard_condition_of(self.node.handle.pointer)
            refusal = _add_guard_condition(self._wait_set.pointer, condition, ctypes.byref(index))
            self._wait_set.wait(0)
            if refusal or self._wait_set.is_ready("guard_condition", index.value):
                self._number += 1
            return self._number
