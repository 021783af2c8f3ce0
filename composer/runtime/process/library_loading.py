"""Loads the shared libraries of ROS while Python reads and checks the files of a system.

rclpy's extension module needs 90 libraries, which take 35 ms to load. Python releases its lock
while it calls a foreign function, though not while it imports an extension module. That import then
finds the libraries loaded.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
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
