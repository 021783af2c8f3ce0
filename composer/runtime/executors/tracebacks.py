"""The Python stacks of threads and tracebacks of exceptions, and what user code raises, as text.

Up to Python 3.11 an allocation may collect garbage, and a finalizer may run Python: other threads
run while a stack is being read, and its frames may go away. ``sys._current_frames`` may then
deadlock (gh-106883), and reading a frame may crash. So no garbage is collected meanwhile.

``__str__`` and ``__repr__`` of what user code raises or returns are user code too: they may raise,
never return, or return anything of any size. The functions that call them raise nothing, and their
text can be printed and published.
"""

from __future__ import annotations

import ctypes
import gc
import os
import re
import site
import sys
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, TypeVar

from composer.model import LogLevel
from composer.model.names import PROGRAM_LOGGER
from composer.runtime.clock import Clock
from composer.runtime.metrics.repeat_limit import RepeatLimit

_COMPOSER = f"{Path(__file__).parents[2]}{os.sep}"
#: The example nodes of an installed composer are user code.
_SHARE = f"{_COMPOSER}share{os.sep}"
_IMPORT_SYSTEM = "<frozen importlib"
#: Where Python's own modules are, and packages that were installed.
_LIBRARIES = (os.path.dirname(os.__file__), *site.getsitepackages())  # noqa: PTH120 - as in code objects

F = TypeVar("F", bound=Callable[..., Any])

#: Code objects of the functions marked by :func:`calls_user_code`, by id: hashing a code object
#: reads all of it.
USER_CODE_CALLERS: dict[int, CodeType] = {}
#: Code objects of the functions marked by :func:`interruptible`, by id.
INTERRUPTIBLE: dict[int, CodeType] = {}

_READING = threading.RLock()
#: The longest texts, in characters.
_LINE_LENGTH = 1000
_VALUE_LENGTH = 80
_TRACEBACK_LENGTH = 20_000
#: Begins the names of the packages that modules of behaviors are imported as.
BEHAVIOR_PACKAGE = "_composer_behavior_"
#: What Python puts before the names of the exceptions that these modules define.
_IN_PACKAGE = re.compile(rf"\b{BEHAVIOR_PACKAGE}[0-9a-f]+\.")


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
    # The outermost frames belong to the thread.
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


def describe(error: BaseException) -> str:
    """Return an exception as one line: its type and its text, if any."""
    kind = _call(_name, type(error)) or "exception"
    text = _call(str, error)
    if text is None:
        return f"{kind}: <its text is not available: __str__ failed>"
    line = _cut(" ".join(text.split()), _LINE_LENGTH)
    return f"{kind}: {line}" if line else kind


def text_of(error: BaseException) -> str:
    """Return the text of an exception as one line; with its type if there is no text."""
    text = _call(str, error)
    return _cut(" ".join(text.split()), _LINE_LENGTH) if text else describe(error)


def report_of(error: BaseException) -> str:
    """Return :func:`describe`, followed by the lines of the traceback.

    The traceback has only the frames of user code, if any; with COMPOSE_DEBUG set, all frames.
    """
    line = describe(error)
    frames = _traceback(error, all_frames=bool(os.environ.get("COMPOSE_DEBUG")))
    return f"{line}\n{frames}" if frames else line


def internal_report_of(error: BaseException) -> str:
    """Return :func:`describe`, followed by the traceback with all frames, for a bug report."""
    return f"{describe(error)}\n{_traceback(error, all_frames=True)}"


def shown(value: object) -> str:
    """Return the beginning of ``repr(value)``, for messages about wrong values."""
    text = _call(repr, value)
    if text is None:
        return f"a {_call(_name, type(value))} whose __repr__ failed"
    return text[:_VALUE_LENGTH]


def printable(text: object) -> str:
    """Return ``str(text)`` as a plain string that can be encoded. Raises what ``str`` raises."""
    if type(text) is str and text.isascii():
        return text
    return _plain(str(text))


def exception_log(
    clock: Clock, write: Callable[[LogLevel, str, str], None]
) -> Callable[[str, BaseException], None]:
    """Return a function that logs an exception that left a callback, by the name of the callback.

    Each callback is logged at most once a second. ``write(level, logger, text)`` gets the lines.
    """
    limit = RepeatLimit(clock)

    def log_exception(what: str, error: BaseException) -> None:
        admission = limit.admit(what)
        if admission is not None:
            text = internal_report_of(error) if admission.is_first else describe(error)
            write(LogLevel.ERROR, PROGRAM_LOGGER, f"{what}: {text}{admission.suffix}")

    return log_exception


def is_closing(error: BaseException) -> bool:
    """Return whether the coroutine that caught ``error`` at an ``await`` is being closed.

    Then Python raises GeneratorExit at the ``await`` itself. If user code has raised it, there are
    frames further in. Call this where the exception was caught.
    """
    at = error.__traceback__
    return issubclass(type(error), GeneratorExit) and (at is None or at.tb_next is None)


@calls_user_code
def _call(function: Callable[[Any], str], argument: object) -> str | None:
    """Return the text that ``function`` returns for ``argument``; None if it raises anything."""
    try:
        return _plain(function(argument))
    except BaseException:
        return None


@calls_user_code
def _traceback(error: BaseException, *, all_frames: bool) -> str:
    """Return the traceback of ``error`` and its causes; empty if no frames are left."""
    try:
        full = traceback.TracebackException.from_exception(error)
        if all_frames or _keep_user_frames(full):
            text = _IN_PACKAGE.sub("", _plain("".join(full.format())))
            return _cut(text.rstrip(), _TRACEBACK_LENGTH)
    except BaseException:
        return "<its traceback is not available>"
    return ""


def _keep_user_frames(full: traceback.TracebackException) -> bool:
    """Remove the composer's frames, of causes too; return whether any frame is left."""
    pending = [full]
    has_frames = False
    while pending:
        entry = pending.pop()
        pending += filter(None, (entry.__cause__, entry.__context__, *(entry.exceptions or ())))
        entry.stack[:] = [frame for frame in entry.stack if not is_internal(frame.filename)]
        has_frames = has_frames or bool(entry.stack)
    return has_frames


def _name(kind: type) -> str:
    return kind.__name__


def _plain(text: str) -> str:
    """Return an instance of exactly ``str``, without lone surrogates."""
    return str.encode(text, errors="backslashreplace").decode()


def _cut(text: str, length: int) -> str:
    """Return ``text`` without its middle if it is longer than ``length``."""
    if len(text) <= length:
        return text
    half = length // 2
    return f"{text[:half]} ... ({len(text) - 2 * half} characters omitted) ... {text[-half:]}"
