"""Finds running callbacks in the stacks of threads, and interrupts them.

Calling a callback costs nothing extra: the health monitor samples the stacks periodically, and a
call that it sees twice has run in between.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from types import FrameType

from composer.base.fast_dataclass import dataclass
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.callbacks.user_code import CallbackQueue
from composer.runtime.clock import COMPUTER
from composer.runtime.executors.base_loop import end_wait
from composer.runtime.executors.tracebacks import (
    INTERRUPTIBLE,
    USER_CODE_CALLERS,
    format_stack,
    gc_paused,
    location_of,
    raise_in,
    stacks_of,
)
from composer.runtime.node.managed_node import ManagedNode
from composer.runtime.node.node import RunningNode
from composer.runtime.ports.mailbox import Mailbox

_COMPOSER = str(Path(__file__).parents[1])
_TRANSITIONS = {id(RunningNode._call_handler.__code__), id(RunningNode._make_behavior.__code__)}
_REACTION = RunningReaction.run.__code__
_ATTEMPTS = 50
_MOMENT_S = 0.001


class CallbackInterrupted(BaseException):
    """Raised in a callback that takes too long, wherever it is.

    Not an ``Exception``, so that a loop with ``except Exception`` does not swallow it.
    """

    def __str__(self) -> str:
        return "the callback took too long"


@dataclass(frozen=True, slots=True, eq=False)
class RunningCallback:
    """A handler or a reaction that runs now.

    ``call`` is a frame that identifies the call. ``name`` is the function that was called;
    ``in_transition`` is true for handlers of transitions.
    """

    thread: int
    call: FrameType
    name: str
    in_transition: bool
    callers: Sequence[FrameType]  # from the frame that calls it, outward

    def node(self, nodes: Iterable[ManagedNode]) -> ManagedNode | None:
        """Return the node among ``nodes`` that it belongs to. Call this once per callback.

        Reading the variables of a frame again releases their earlier values, which may run Python
        code while the frame is read.
        """
        owners = {id(part): node for node in nodes for part in node.callback_owners}
        with gc_paused():
            for frame in self.callers:
                subject = frame.f_locals.get("self")
                owner = owners.get(id(subject)) or owners.get(
                    id(getattr(subject, "_context", None))
                )
                if owner is not None or isinstance(subject, (CallbackQueue, Mailbox)):
                    return owner
        return None

    def stack(self) -> str:
        """Return the Python stack of the callback; empty if it has returned."""
        stack = stacks_of((self.thread,)).get(self.thread, [])
        return format_stack(stack[: stack.index(self.call)]) if self.call in stack else ""

    def location(self) -> str:
        """Return the ``file:line`` that it has reached; empty if it has returned."""
        stack = stacks_of((self.thread,)).get(self.thread, [])
        return location_of(stack[: stack.index(self.call)]) if self.call in stack else ""

    def interrupt(self, kind: type[BaseException] = CallbackInterrupted) -> None:
        """Raise ``kind`` in it, where it waits or as soon as it runs Python code of the user.

        In a function of C, such as ``time.sleep``, it is raised once that returns. A callback that
        is always in code of the composer when its stack is sampled is not interrupted.
        """
        for _ in range(_ATTEMPTS):
            # After a sleep, this thread holds the GIL for 5 ms, so the sampled stack stays valid.
            COMPUTER.sleep(_MOMENT_S)
            stack = stacks_of((self.thread,)).get(self.thread, [])
            if self.call not in stack:
                return
            at = next(_callers(stack), None)
            if at is None or _plain_frame(stack[at:]) is not self.call:
                continue
            if end_wait(self.thread, kind):
                return
            if not any(map(_is_composer, stack[:at])):
                raise_in(self.thread, kind)
                return


def running_callbacks(threads: Iterable[int]) -> Iterator[list[RunningCallback]]:
    """Yield for each of the threads the callbacks that run now, the innermost first.

    Delivery calls the callback of a receiver within that of the sender.
    """
    for ident, stack in stacks_of(threads).items():
        if callbacks := [_callback(ident, stack, at) for at in _callers(stack)]:
            yield callbacks


def _callers(stack: Sequence[FrameType]) -> Iterator[int]:
    """Yield, for each callback on a stack, the index of the frame that calls it."""
    inner: FrameType | None = None
    for at, frame in enumerate(stack):
        calls_user = id(frame.f_code) in USER_CODE_CALLERS and (
            inner is None or not _is_composer(inner)
        )
        if calls_user or frame.f_code is _REACTION:
            yield at
        inner = frame


def _callback(ident: int, stack: Sequence[FrameType], at: int) -> RunningCallback:
    callers = stack[at:]
    is_reaction = callers[0].f_code is _REACTION
    name = "a reaction" if is_reaction else stack[max(at - 1, 0)].f_code.co_name
    in_transition = any(id(frame.f_code) in _TRANSITIONS for frame in callers[:2])
    return RunningCallback(ident, _plain_frame(callers), name, in_transition, callers)


def _plain_frame(callers: Sequence[FrameType]) -> FrameType:
    """Return the first frame of a plain function: frames of coroutines outlive a call."""
    coroutine = inspect.CO_COROUTINE | inspect.CO_GENERATOR | inspect.CO_ITERABLE_COROUTINE
    return next((frame for frame in callers if not frame.f_code.co_flags & coroutine), callers[0])


def _is_composer(frame: FrameType) -> bool:
    return frame.f_code.co_filename.startswith(_COMPOSER) and id(frame.f_code) not in INTERRUPTIBLE
