"""Where the composer calls what users have written.

Whoever looks at the stack of a thread knows by these functions whether it is in a callback, and
only what is within them may be interrupted: our own code is not written to be.
"""

from __future__ import annotations

from collections.abc import Callable
from types import CodeType
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

#: The code of every function that is marked, by its id: to hash code is to read all of it.
CALLERS: dict[int, CodeType] = {}
#: The code of every function of ours that may be interrupted as well.
HARMLESS: dict[int, CodeType] = {}


def may_be_interrupted(function: F) -> F:
    """Mark a function that users call and that changes nothing."""
    HARMLESS[id(function.__code__)] = function.__code__
    return function


def calls_user_code(function: F) -> F:
    """Mark a function whose direct calls of what is not ours lead to a user's code.

    It has to take whatever that raises, ``BaseException`` included, as a fault of the user's.
    Marking costs nothing when it is called.
    """
    CALLERS[id(function.__code__)] = function.__code__
    return function
