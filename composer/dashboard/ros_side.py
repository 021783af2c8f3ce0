"""The part of the dashboard that is in the ROS graph, only while a browser is connected."""

from __future__ import annotations

import asyncio
import ctypes
import gc
import logging
import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, TypeVar

from composer.dashboard.feeds import Feeds
from composer.dashboard.protocol.messages import RequestError, from_ros

if TYPE_CHECKING:
    from composer.client.session import Deadline
    from composer.dashboard.forms import Forms
    from composer.dashboard.observing.ros_graph import RosGraph

T = TypeVar("T")

#: After the last browser has left, as one that loads the page again comes back at once.
LINGER_S = 3.0
_THREADS = 8
_BACKGROUND_THREADS = 2
#: Requests that run or wait for a thread; more are refused.
_MAX_REQUESTS = 32
_JOINED_WITHIN_S = 20.0
_IMPORTING = threading.Lock()


class RosSide:
    """Joins the ROS graph for the first browser and leaves it after the last one."""

    def __init__(self, feeds: Feeds, forms: Forms) -> None:
        self._feeds = feeds
        self._forms = forms
        self._lock = threading.Lock()
        self._browsers = 0
        self._left_s = 0.0
        self._thread: threading.Thread | None = None
        self._graph: RosGraph | None = None
        self._joined = threading.Event()
        self._pool = ThreadPoolExecutor(_THREADS, thread_name_prefix="request")
        # Apart from requests, which may take all of their threads for minutes.
        self._background = ThreadPoolExecutor(_BACKGROUND_THREADS, thread_name_prefix="work")
        self._requests = 0
        self._is_open = True
        self.state, self.message = "left", ""

    def prepare(self) -> None:
        """Import what joining takes, so that the first browser does not wait for that.

        Systems on this computer are asked for their endpoints: they keep the answer.
        """
        threading.Thread(target=_logged, args=(_prepare,), name="prepare", daemon=True).start()

    def enter(self) -> None:
        """Count one more browser; the first one makes the dashboard join the ROS graph."""
        with self._lock:
            self._browsers += 1
            if self._thread is None and self._is_open:
                self._joined.clear()
                self._thread = threading.Thread(target=self._run, name="feeds", daemon=True)
                self._thread.start()

    def leave(self) -> None:
        """Count one browser less."""
        with self._lock:
            self._browsers -= 1
            self._left_s = time.monotonic()

    def close(self, within_s: float) -> None:
        """Leave the ROS graph, and wait for that."""
        with self._lock:
            self._is_open = False
            thread = self._thread
        self._feeds.stop()
        for pool in (self._pool, self._background):
            pool.shutdown(wait=False, cancel_futures=True)
        if thread is not None:
            thread.join(within_s)

    async def call(self, operation: Callable[[RosGraph, Deadline], T], timeout_s: float) -> T:
        """Return the result of an operation, which runs on a worker thread.

        Raises what it raises; RequestError if the ROS graph cannot be joined or too many requests
        run.
        """
        if self._requests >= _MAX_REQUESTS:
            raise RequestError("busy", f"{_MAX_REQUESTS} requests are running: try again later")
        self._requests += 1
        try:
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(self._pool, self._call, operation, timeout_s)
        finally:
            self._requests -= 1

    def _call(self, operation: Callable[[RosGraph, Deadline], T], timeout_s: float) -> T:
        if not self._joined.wait(_JOINED_WITHIN_S) or self._graph is None:
            raise RequestError("failed", self.message or "the ROS graph cannot be joined")
        from composer.client.session import Deadline, RosError

        try:
            return operation(self._graph, Deadline(timeout_s))
        except RosError as error:
            raise from_ros(error) from error

    def _work(self, function: Callable[[], None]) -> None:
        with suppress(RuntimeError):  # the dashboard ends
            self._background.submit(_logged, function)

    def _is_needed(self) -> bool:
        """Return whether to stay in the ROS graph; if not, the next browser makes it join again."""
        with self._lock:
            if self._is_open and (self._browsers or time.monotonic() < self._left_s + LINGER_S):
                return True
            # From here on, the next browser may start another thread: this one says nothing more.
            self._thread, self._graph, self.state = None, None, "left"
            return False

    def _run(self) -> None:
        self.state, self.message = "joining", ""
        try:
            self._run_feeds()
        except Exception as error:  # say why in the browser
            logging.getLogger(__name__).exception("the dashboard is not in the ROS graph")
            with self._lock:
                if self._thread is threading.current_thread():
                    self._thread, self._graph = None, None
                    self.state, self.message = "failed", str(error)
                    self._joined.set()
        _return_memory()

    def _run_feeds(self) -> None:
        """Join the ROS graph, and leave it when no browser is left."""
        with ExitStack() as stack:
            graph = self._join(stack)
            with self._lock:
                self._graph = graph
            self.state = "ready"
            self._joined.set()
            self._feeds.run(graph, self._is_needed)

    def _join(self, stack: ExitStack) -> RosGraph:
        _import()
        from composer.client.shared_session import SharedSession
        from composer.dashboard.observing.ros_graph import RosGraph
        from composer.dashboard.observing.topics import first_topology
        from composer.runtime.middleware.dds_xml import announce_less_often
        from composer.runtime.middleware.environment import prepare_environment

        prepare_environment()
        announce_less_often(os.environ)
        first = first_topology()
        session = stack.enter_context(SharedSession())
        return stack.enter_context(
            RosGraph(session, self._forms, self._work, first, self._feeds.poll_reports)
        )


def _import() -> None:
    """Import what joining takes, on one thread at a time: modules of rclpy import each other."""
    with _IMPORTING:
        import composer.client.shared_session
        import composer.dashboard.observing.ros_graph
        import composer.runtime.middleware.dds_xml  # noqa: F401


def _return_memory() -> None:
    """Return the memory of a session to the operating system.

    glibc keeps free memory: without this, any program grows by 0.2 MB each time it joins and leaves
    the ROS graph.
    """
    gc.collect()  # nodes are in reference cycles, and the next collection may be far off
    with suppress(AttributeError):  # another C library
        ctypes.CDLL(None).malloc_trim(0)


def _prepare() -> None:
    _import()
    from composer.dashboard.observing.topics import first_topology

    first_topology()


def _logged(function: Callable[[], None]) -> None:
    try:
        function()
    except Exception:
        logging.getLogger(__name__).exception("background work failed")
