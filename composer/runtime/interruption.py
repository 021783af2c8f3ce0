"""Callbacks that do not return: found by looking at the stacks of threads, and interrupted.

Nothing is counted or timed when a callback is called, so watching costs nothing there: whoever
watches looks every now and then, and what he sees twice has run in between.
"""

from __future__ import annotations

import ctypes
import inspect
import sys
import traceback
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from composer.runtime.line import Line
from composer.runtime.loop import Loop
from composer.runtime.node import RunningNode

_OURS = str(Path(__file__).parent)
_TRANSITIONS = (RunningNode.on_transition.__code__, RunningNode.on_error.__code__)


class CallbackInterrupted(BaseException):
    """Raised in a callback that takes too long, wherever it is.

    Not an ``Exception``, so that a loop with ``except Exception`` does not swallow it.
    """

    def __str__(self) -> str:
        return "the callback took too long"


@dataclass(frozen=True, slots=True)
class RunningCallback:
    """A callback of a node that runs now. Two of them are equal when it is the same call.

    ``name`` is its function; ``in_transition`` is true for the handlers of transitions.
    """

    node: RunningNode = field(compare=False)
    thread: int
    frame: FrameType = field(repr=False)
    name: str = field(compare=False)
    in_transition: bool = field(compare=False)

    def stack(self) -> str:
        """Return the Python stack as far as it belongs to the callback; empty when it has ended."""
        innermost = sys._current_frames().get(self.thread)
        frames = list(_outward(innermost))
        if self.frame not in frames:
            return ""
        inner = frames[: frames.index(self.frame)]
        lines = traceback.StackSummary.extract((frame, frame.f_lineno) for frame in inner[::-1])
        return "".join(lines.format())

    def runs(self) -> bool:
        """Say whether it still has not returned."""
        return self.frame in _outward(sys._current_frames().get(self.thread))

    def interrupt(self) -> None:
        """Raise CallbackInterrupted in it, as soon as it is back from whatever is not Python."""
        if self.runs():
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(self.thread), ctypes.py_object(CallbackInterrupted)
            )


def running_callbacks(loop: Loop, nodes: Iterable[RunningNode]) -> Iterator[RunningCallback]:
    """Yield the callbacks of ``nodes`` that ``loop`` is in now."""
    idents = loop.threads()
    if not idents:
        return
    owners = {id(part): node for node in nodes for part in (node, *node.cores)}
    frames = sys._current_frames()
    for ident in idents:
        found = _callback(ident, frames.get(ident), owners)
        if found is not None:
            yield found


def _callback(
    ident: int, innermost: FrameType | None, owners: dict[int, RunningNode]
) -> RunningCallback | None:
    """Return the callback on a thread's stack.

    It is called by something that belongs to a node: its core, a port, the node itself. A line
    calls one callback after the other, so what is outside of it is no mark of one call.
    """
    node: RunningNode | None = None
    outermost: FrameType | None = None
    in_transition = False
    for frame in _outward(innermost):
        subject = frame.f_locals.get("self")
        if isinstance(subject, Line):
            break
        owner = owners.get(id(subject)) or owners.get(id(getattr(subject, "_core", None)))
        if owner is not None:
            node, outermost = owner, frame
            in_transition = frame.f_code in _TRANSITIONS
    if node is None or outermost is None:
        return None
    call = _plain(outermost)
    return RunningCallback(node, ident, call, _name(innermost, call), in_transition)


def _plain(frame: FrameType) -> FrameType:
    """Return the nearest frame outward that is one call: coroutines outlive the calls of theirs."""
    lasting = inspect.CO_COROUTINE | inspect.CO_GENERATOR | inspect.CO_ITERABLE_COROUTINE
    while frame.f_code.co_flags & lasting and frame.f_back is not None:
        frame = frame.f_back
    return frame


def _name(innermost: FrameType | None, call: FrameType) -> str:
    """Return the name of the first function that is not ours within ``call``, else of ``call``."""
    name = call.f_code.co_name
    for frame in _outward(innermost):
        if frame is call:
            break
        if not frame.f_code.co_filename.startswith(_OURS):
            name = frame.f_code.co_name
    return name


def _outward(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back
