"""Stacks of running threads, read while garbage collection is paused."""

from __future__ import annotations

import gc
import sys
import threading
import time
import weakref
from collections.abc import Iterator

import pytest

from composer.runtime.executors.tracebacks import (
    describe,
    format_stack,
    gc_paused,
    stacks_of,
    user_frames,
)


@pytest.fixture
def waiting() -> Iterator[int]:
    """The identifier of a thread that waits in a known function."""
    is_there, may_go = threading.Event(), threading.Event()

    def wait_here() -> None:
        is_there.set()
        may_go.wait()

    thread = threading.Thread(target=wait_here)
    thread.start()
    is_there.wait()
    assert thread.ident is not None
    while sys._current_frames()[thread.ident].f_code.co_name != "wait":
        time.sleep(0.001)  # it has started but does not wait yet
    yield thread.ident
    may_go.set()
    thread.join()


def test_the_innermost_frame_is_first_and_shown_last(waiting: int) -> None:
    stacks = stacks_of((0, waiting))
    assert list(stacks) == [waiting], "a thread that has ended is left out"
    stack = stacks[waiting]
    names = [frame.f_code.co_name for frame in stack]
    assert "wait_here" in names
    assert names[-1] == "_bootstrap"
    lines = format_stack(stack).splitlines()
    assert lines[0].endswith("in _bootstrap")
    assert "may_go.wait()" in format_stack(stack)


def test_user_frames_are_those_within_the_composer(waiting: int) -> None:
    stack = stacks_of((waiting,))[waiting]
    assert user_frames(stack) == stack, "the composer is not in it"
    found: list[str] = []

    class Raised(Exception):
        def __str__(self) -> str:
            frames = user_frames(stacks_of((threading.get_ident(),))[threading.get_ident()])
            found.extend(frame.f_code.co_name for frame in frames)
            return ""

    describe(Raised())
    assert found == ["__str__"]


@pytest.mark.parametrize("collects", [True, False])
def test_garbage_collection_is_restored(collects: bool) -> None:
    before = gc.isenabled()
    try:
        (gc.enable if collects else gc.disable)()
        with gc_paused(), gc_paused():
            assert not gc.isenabled()
        assert gc.isenabled() is collects
    finally:
        (gc.enable if before else gc.disable)()


def test_concurrent_use_does_not_enable_the_collector_too_early() -> None:
    seen = []

    def look() -> None:
        for _ in range(2000):
            with gc_paused():
                seen.append(gc.isenabled())

    threads = [threading.Thread(target=look) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not any(seen)
    assert gc.isenabled()


def test_a_stack_trace_keeps_no_frame_alive() -> None:
    """Otherwise large messages of a callback are kept until the next garbage collection."""
    is_there, may_go = threading.Event(), threading.Event()
    held: list[weakref.ref[set[int]]] = []

    def hold() -> None:
        large = {1, 2, 3}
        held.append(weakref.ref(large))
        is_there.set()
        may_go.wait()

    thread = threading.Thread(target=hold)
    with gc_paused():
        thread.start()
        is_there.wait()
        assert stacks_of((thread.ident or 0,))
        may_go.set()
        thread.join()
        assert held[0]() is None
