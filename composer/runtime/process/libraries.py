"""Loads the shared libraries of ROS while Python reads and checks the files of a system.

rclpy's extension module needs 90 libraries, which take 35 ms to load. Python releases its lock
while it calls a foreign function, though not while it imports an extension module. That import then
finds the libraries loaded.

Fast exit: leave the ROS graph with all nodes at once, right before the process ends.

Fast DDS searches all endpoints of a participant for each endpoint that it destroys, so 300 nodes
take half a minute one by one. Other processes only need to know that the participant is gone, which
Fast DDS announces when it is stopped: that takes a second for the same 300 nodes.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path
from threading import Thread

_MODULE = "_rclpy_pybind11"
#: With these, loading rcl ends the process if the middleware is not the selected one.
_CHECKED_WHILE_LOADING = ("RMW_IMPLEMENTATION", "RCL_ASSERT_RMW_ID_MATCHES")


@contextmanager
def loading_libraries() -> Iterator[None]:
    """Load the libraries of rclpy on another thread until the end of the ``with`` block.

    Change no environment variable within the block: initializers of the libraries read them. An
    import of an extension module would wait for the thread. What cannot be loaded is not reported,
    because importing rclpy reports it.
    """
    path = None if any(map(os.environ.get, _CHECKED_WHILE_LOADING)) else _extension_module()
    if path is None:
        yield
        return
    thread = Thread(target=_load, args=(path,), name="library loading")
    thread.start()
    try:
        yield
    finally:
        thread.join()


def _extension_module() -> Path | None:
    spec = find_spec("rclpy")
    if spec is None or spec.origin is None:
        return None
    return Path(spec.origin).parent / f"{_MODULE}{EXTENSION_SUFFIXES[0]}"


def _load(path: Path) -> None:
    load = ctypes.CDLL(None).dlopen
    load.argtypes, load.restype = (ctypes.c_char_p, ctypes.c_int), ctypes.c_void_p
    load(os.fsencode(path), sys.getdlopenflags())


#: ``eprosima::fastrtps::rtps::RTPSDomain::stopAll()``: public, static, without arguments.
_STOP_ALL = "_ZN8eprosima8fastrtps4rtps10RTPSDomain7stopAllEv"
_LIBRARY = "libfastrtps.so"


def supports_fast_exit() -> bool:
    """Return whether the middleware in use supports a fast exit."""
    return _stop_all() is not None


def leave_ros_graph() -> bool:
    """Remove all participants of this process from the ROS graph; return False if unsupported.

    No thread may use ROS meanwhile, and nothing of ROS may be used or destroyed afterwards:
    ``os._exit`` has to follow.
    """
    stop_all = _stop_all()
    if stop_all is None:
        return False
    stop_all()
    return True


def _stop_all() -> Callable[[], object] | None:
    """Return the function of the Fast DDS library that this process has loaded."""
    for line in Path("/proc/self/maps").read_text(encoding="utf-8").splitlines():
        path = line.partition("/")[2]
        if path.rpartition("/")[2].startswith(_LIBRARY):
            stop_all = getattr(ctypes.CDLL(f"/{path}"), _STOP_ALL, None)
            if stop_all is not None:
                stop_all.restype = None
            return stop_all
    return None
