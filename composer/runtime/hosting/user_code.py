"""Calls the code of hosted classes, so that it is known which node's code a thread runs."""

from __future__ import annotations

import ctypes
import inspect
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from composer.behavior import CallCancelled
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.stacks import calls_user_code, is_internal, stacks_of
from composer.runtime.executors.strand import in_steps

if TYPE_CHECKING:
    from composer.runtime.callbacks.context import NodeContext
    from composer.runtime.hosting.instance import Instance


class _Current(threading.local):
    instance: Instance | None = None


_CURRENT = _Current()
_STARTED_BY = "_composer_instance"


def current_instance() -> Instance | None:
    """Return the instance whose code the calling thread runs, or None.

    Threads that an instance has started run its code.
    """
    return _CURRENT.instance or getattr(threading.current_thread(), _STARTED_BY, None)


def on_thread_start(thread: threading.Thread) -> None:
    """Remember which instance has started a thread, if any."""
    instance = current_instance()
    if instance is not None:
        instance.threads.append(thread)
        setattr(thread, _STARTED_BY, instance)


class UserFunction:
    """A function of a hosted class; plain, or a coroutine function if ``is_async``.

    SystemExit means that the class has finished: the node is deactivated.
    """

    def __init__(self, instance: Instance, function: Callable[..., Any]) -> None:
        self._context = instance.context  # by which a call on a stack is recognized
        self._instance = instance
        self._function = function
        self.is_async = inspect.iscoroutinefunction(function)
        self.__name__ = getattr(function, "__name__", type(function).__name__)
        self.__qualname__ = getattr(function, "__qualname__", self.__name__)

    @calls_user_code
    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Call the function. Raises what it raises."""
        before, _CURRENT.instance = _CURRENT.instance, self._instance
        try:
            result = self._function(*arguments, **options)
        except SystemExit:
            self._instance.finish("it raised SystemExit")
            return None
        except CallCancelled as error:  # it waited for a response when the node left *active*
            if self._context.gate.incoming:
                raise
            self._context.log.debug(f"{self.__name__}: {error}")
            return None
        finally:
            _CURRENT.instance = before
        return in_steps(_Steps(self._instance), result) if inspect.iscoroutine(result) else result


def call_in_group(context: NodeContext, function: Callable[..., Any], *arguments: Any) -> None:
    """Call ``function`` of a class as its callback group permits, if the node is active then."""

    def call() -> None:
        if context.gate.incoming:
            rest = context.call(function.__name__, function, *arguments)
            if rest is not None:
                context.spawn(context.strand.wrap(rest))

    context.strand.post(call)


class _Steps:
    """Sets the instance whose code runs for each step of a coroutine."""

    __slots__ = ("_before", "_instance")

    def __init__(self, instance: Instance) -> None:
        self._instance = instance
        self._before: Instance | None = None

    def enter(self) -> None:
        """Begin a step, at once."""
        self._before, _CURRENT.instance = _CURRENT.instance, self._instance

    def leave(self) -> None:
        """End a step."""
        _CURRENT.instance = self._before


class CallAbandoned(BaseException):
    """Raised in a constructor or transition handler that has exceeded its time limit."""


class ThreadedCall:
    """A call of user code that may block, on a thread of its own: the loop goes on."""

    def __init__(self, instance: Instance, function: Callable[[], Any], name: str) -> None:
        self._instance = instance
        self._function = function
        self._done: Future[Any] = Future()
        #: Where it was when its time was over: ``file:line``, in code of the user.
        self.location = ""
        #: The thread of the call.
        self.thread = threading.Thread(target=self._run, name=name, daemon=True)

    async def result(self) -> Any:
        """Make the call and return its result. Raises what it raises.

        If the caller is canceled, the call is interrupted as soon as it runs code of the user.
        """
        self.thread.start()
        try:
            return await self._done
        except Cancelled:
            self.location = self._find_location()
            threading.Thread(target=self._abandon, daemon=True).start()
            raise

    def _find_location(self) -> str:
        for frame in stacks_of((self.thread.ident or 0,)).get(self.thread.ident or 0, ()):
            if not is_internal(frame.f_code.co_filename):
                return f"{frame.f_code.co_filename}:{frame.f_lineno}"
        return ""

    @calls_user_code
    def _run(self) -> None:
        _CURRENT.instance = self._instance
        try:
            self._done.set_result(self._function())
        except BaseException as error:
            self._done.set_exception(error)

    def _abandon(self) -> None:
        for _ in range(_ATTEMPTS):
            stack = stacks_of((self.thread.ident or 0,)).get(self.thread.ident or 0)
            if stack is None:
                return
            if not is_internal(stack[0].f_code.co_filename):
                thread = ctypes.c_ulong(self.thread.ident or 0)
                ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, ctypes.py_object(CallAbandoned))
                return
            del stack
            self.thread.join(_PERIOD_S)


_ATTEMPTS = 50
_PERIOD_S = 0.02
