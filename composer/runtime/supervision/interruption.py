"""Callbacks that do not return: found by looking at the stacks of threads, and interrupted.

Nothing is counted or timed when a callback is called, so watching costs nothing there: whoever
watches looks every now and then, and what he sees twice has run in between.
"""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import sleep
from types import FrameType

from composer.runtime.callbacks.queue import Line
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.stacks import shown, stacks_of, undisturbed
from composer.runtime.executors.user_code import CALLERS, HARMLESS
from composer.runtime.node.node import RunningNode
from composer.runtime.ports.mailbox import Mailbox

_OURS = str(Path(__file__).parents[1])
_TRANSITIONS = {id(RunningNode._tell.__code__), id(RunningNode._make_behavior.__code__)}
_REACTION = RunningReaction.run.__code__
_TRIES = 50
_MOMENT_S = 0.001


class CallbackInterrupted(BaseException):
    """Raised in a callback that takes too long, wherever it is.

    Not an ``Exception``, so that a loop with ``except Exception`` does not swallow it.
    """

    def __str__(self) -> str:
        return "the callback took too long"


@dataclass(frozen=True, slots=True, eq=False)
class RunningCallback:
    """What a user has written, in Python or as a reaction, that runs now.

    ``call`` is the same as long as it is the same call. ``name`` is the function that was called;
    ``in_transition`` is true for what belongs to a transition.
    """

    thread: int
    call: FrameType
    name: str
    in_transition: bool
    _callers: Sequence[FrameType]  # from the frame that calls it outward

    def node(self, nodes: Iterable[RunningNode]) -> RunningNode | None:
        """Return which of ``nodes`` it belongs to. To be asked once, of what does not return.

        Reading the variables of a frame a second time drops what they were before, which may run
        Python while the frame is looked at.
        """
        owners = {id(part): node for node in nodes for part in (node, *node.cores)}
        with undisturbed():
            for frame in self._callers:
                subject = frame.f_locals.get("self")
                owner = owners.get(id(subject)) or owners.get(id(getattr(subject, "_core", None)))
                if owner is not None or isinstance(subject, (Line, Mailbox)):
                    return owner
        return None

    def stack(self) -> str:
        """Return the Python stack as far as it belongs to the callback; empty when it has ended."""
        stack = stacks_of((self.thread,)).get(self.thread, [])
        return shown(stack[: stack.index(self.call)]) if self.call in stack else ""

    def interrupt(self) -> None:
        """Raise CallbackInterrupted in it, as soon as it is back from whatever is not Python.

        It strikes in a user's Python alone. What never is there when somebody looks, but always in
        something of ours, is let be.
        """
        exception = ctypes.py_object(CallbackInterrupted)
        thread = ctypes.c_ulong(self.thread)
        for _ in range(_TRIES):
            # Who slept and is given the interpreter's lock has it for 5 ms: what is seen holds.
            sleep(_MOMENT_S)
            stack = stacks_of((self.thread,)).get(self.thread, [])
            if self.call not in stack:
                return
            at = next(_callers(stack), None)
            if at is None or _plain(stack[at:]) is not self.call:
                continue
            if not any(map(_is_ours, stack[:at])):
                ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, exception)
                return


def running_callbacks(loop: Loop) -> Iterator[list[RunningCallback]]:
    """Yield the callbacks that each thread of ``loop`` is in now, the innermost first.

    Delivering a message calls the callback of another node within that of its sender.
    """
    for ident, stack in stacks_of(loop.threads()).items():
        if found := [_callback(ident, stack, at) for at in _callers(stack)]:
            yield found


def _callers(stack: Sequence[FrameType]) -> Iterator[int]:
    """Yield, for each callback on a stack, where the frame is that calls it."""
    inner: FrameType | None = None
    for at, frame in enumerate(stack):
        calls_user = id(frame.f_code) in CALLERS and (inner is None or not _is_ours(inner))
        if calls_user or frame.f_code is _REACTION:
            yield at
        inner = frame


def _callback(ident: int, stack: Sequence[FrameType], at: int) -> RunningCallback:
    callers = stack[at:]
    is_reaction = callers[0].f_code is _REACTION
    name = "a reaction" if is_reaction else stack[max(at - 1, 0)].f_code.co_name
    in_transition = any(id(frame.f_code) in _TRANSITIONS for frame in callers[:2])
    return RunningCallback(ident, _plain(callers), name, in_transition, callers)


def _plain(callers: Sequence[FrameType]) -> FrameType:
    """Return the first frame that is one call: coroutines outlive the calls of theirs."""
    lasting = inspect.CO_COROUTINE | inspect.CO_GENERATOR | inspect.CO_ITERABLE_COROUTINE
    return next((frame for frame in callers if not frame.f_code.co_flags & lasting), callers[0])


def _is_ours(frame: FrameType) -> bool:
    return frame.f_code.co_filename.startswith(_OURS) and id(frame.f_code) not in HARMLESS
