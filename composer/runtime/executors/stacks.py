"""The Python stacks of running threads, and which of their frames call user code.

Up to Python 3.11 an allocation may collect garbage, and a finalizer may run Python: other threads
run while a stack is being read, and its frames may go away. ``sys._current_frames`` may then
deadlock (gh-106883), and reading a frame may crash. So no garbage is collected meanwhile.
"""

from __future__ import annotations

import ctypes
import gc
import os
import site
import sys
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, TypeVar

_COMPOSER = f"{Path(__file__).parents[2]}{os.sep}"
#: The example nodes of an installed composer are user code.
_SHARE = f"{_COMPOSER}share{os.sep}"
_IMPORT_SYSTEM = "<frozen importlib"
#: Where Python's own modules are, and packages that were installed.
_LIBRARIES = (os.path.dirname(os.__file__), *site.getsitepackages())  # noqa: PTH120

F = TypeVar("F", bound=Callable[..., Any])

#: Code objects of the functions marked by :func:`calls_user_code`, by id: hashing a code object
#: reads all of it.
USER_CODE_CALLERS: dict[int, CodeType] = {}
#: Code objects of the functions marked by :func:`interruptible`, by id.
INTERRUPTIBLE: dict[int, CodeType] = {}

_READING = threading.RLock()


def calls_user_code(function: F) -> F:
    """Mark a function that calls user code directly.

    Interrupts are raised only in user code. The function must treat every exception of a call,
    ``BaseException`` included, as a fault of the user code. The mark has no cost per call.
    """
    USER_CODE_CALLERS[id(function.__code__)] = function.__code__
    return function


def interruptible(function: F) -> F:
    """Mark a function of the composer that user code calls and that may be interrupted."""
    INTERRUPTIBLE[id(function.__code__)] = function.__code__
    return function


@contextmanager
def gc_paused() -> Iterator[None]:
    """Collect no garbage within the block."""
    with _READING:
        was_enabled = gc.isenabled()
        gc.disable()
        try:
            yield
        finally:
            if was_enabled:
                gc.enable()


def stacks_of(threads: Iterable[int]) -> dict[int, list[FrameType]]:
    """Return the frames of the threads with these identifiers, the innermost first."""
    idents = tuple(threads)
    if not idents:
        return {}
    with gc_paused():
        current = sys._current_frames()
        stacks = {ident: list(outward(current[ident])) for ident in idents if ident in current}
        # This frame is among them: a cycle, which would keep the callbacks' locals, such as large
        # messages, until the next garbage collection.
        current.clear()
        return stacks


def raise_in(thread: int, kind: type[BaseException]) -> None:
    """Raise an exception in a thread as soon as it runs Python code, in whatever function."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(kind))


def format_stack(stack: Sequence[FrameType]) -> str:
    """Return a stack as text, as in a traceback."""
    lines = traceback.StackSummary.extract((frame, frame.f_lineno) for frame in stack[::-1])
    return "".join(lines.format())


def format_stacks(threads: Iterable[int]) -> str:
    """Return the stacks of threads as text; empty if there are none.

    Of a callback, they show the frames of user code only, unless COMPOSE_DEBUG is set.
    """
    stacks = stacks_of(threads).values()
    if not os.environ.get("COMPOSE_DEBUG"):
        return "\n".join(format_stack(user_frames(stack)) for stack in stacks)
    return "\n".join(map(format_stack, stacks))


def user_frames(stack: Sequence[FrameType]) -> Sequence[FrameType]:
    """Return the frames of a stack that belong to user code; all of them if none does."""
    internal = [is_internal(frame.f_code.co_filename) for frame in stack]
    # The outermost frames are those of the thread.
    depth = len(internal) - internal[::-1].index(True) - 1 if True in internal else 0
    return [
        frame for frame, skip in zip(stack[:depth], internal, strict=False) if not skip
    ] or stack


def location_of(stack: Iterable[FrameType]) -> str:
    """Return ``file:line`` of the innermost frame of the user's own code; empty if there is none.

    Code of libraries counts only if there is no other.
    """
    outside = [frame for frame in stack if not is_internal(frame.f_code.co_filename)]
    own = [frame for frame in outside if not is_library(frame.f_code.co_filename)]
    for frame in own or outside:
        return f"{frame.f_code.co_filename}:{frame.f_lineno}"
    return ""


def is_internal(path: str) -> bool:
    """Return whether a source file belongs to the composer or to Python's import system."""
    is_composer = path.startswith(_COMPOSER) and not path.startswith(_SHARE)
    return is_composer or path.startswith(_IMPORT_SYSTEM)


def is_library(path: str) -> bool:
    """Return whether a source file is one of Python's modules, or of an installed package."""
    return path.startswith(_LIBRARIES)


def outward(frame: FrameType | None) -> Iterator[FrameType]:
    """Yield a frame and those that have called it, the innermost first."""
    while frame is not None:
        yield frame
        frame = frame.f_back
