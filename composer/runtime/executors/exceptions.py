"""What user code raises or returns, as text.

Its ``__str__`` and ``__repr__`` are user code too: they may raise, never return, or return anything
of any size. The functions here raise nothing, and their text can be printed and published.
"""

from __future__ import annotations

import os
import re
import traceback
from collections.abc import Callable
from typing import Any

from composer.model import LogLevel
from composer.model.names import PROGRAM_LOGGER
from composer.runtime.clock import Clock
from composer.runtime.executors.stacks import calls_user_code, is_internal
from composer.runtime.metrics.repeat_limit import RepeatLimit

#: The longest texts, in characters.
_LINE_LENGTH = 1000
_VALUE_LENGTH = 80
_TRACEBACK_LENGTH = 20_000
#: Begins the names of the packages that modules of behaviors are imported as.
BEHAVIOR_PACKAGE = "_composer_behavior_"
#: What Python puts before the names of the exceptions that these modules define.
_IN_PACKAGE = re.compile(rf"\b{BEHAVIOR_PACKAGE}[0-9a-f]+\.")


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
