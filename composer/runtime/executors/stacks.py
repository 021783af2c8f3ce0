"""The Python stacks of threads that go on while somebody looks at them.

Up to Python 3.11 garbage may be collected whenever something is allocated, and what is collected
may run Python: the threads change in the middle of a look, and the frame that is looked at is gone.
``sys._current_frames`` may wait for itself then (gh-106883), and reading a frame crash.
"""

from __future__ import annotations

import gc
import sys
import threading
import traceback
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

_LOOKING = threading.RLock()


@contextmanager
def undisturbed() -> Iterator[None]:
    """Collect no garbage meanwhile."""
    with _LOOKING:
        collects = gc.isenabled()
        gc.disable()
        try:
            yield
        finally:
            if collects:
                gc.enable()


def stacks_of(threads: Iterable[int]) -> dict[int, list[FrameType]]:
    """Return the frames of the threads with these identifiers, the innermost first."""
    wanted = tuple(threads)
    if not wanted:
        return {}
    with undisturbed():
        current = sys._current_frames()
        stacks = {ident: list(_outward(current[ident])) for ident in wanted if ident in current}
        # This very frame is among them: a cycle, which would keep what callbacks hold, large
        # messages above all, until garbage is collected.
        current.clear()
        return stacks


def shown(stack: Sequence[FrameType]) -> str:
    """Return a stack as in a traceback."""
    lines = traceback.StackSummary.extract((frame, frame.f_lineno) for frame in stack[::-1])
    return "".join(lines.format())


def where(threads: Iterable[int]) -> str:
    """Return the stacks of threads as text; empty when there are none."""
    return "\n".join(map(shown, stacks_of(threads).values()))


def _outward(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back
