"""The plugin of pytest: fixtures for tests of behaviors and systems.

Everything else is imported by the first test that uses a fixture.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from composer.testing import BehaviorTest, SystemTest

#: The tests that the fixtures of a test have opened.
_OPENED = pytest.StashKey[list[Any]]()


@pytest.fixture
def behavior_test(request: pytest.FixtureRequest) -> Iterator[Callable[..., BehaviorTest]]:
    """Return a function that opens a ``BehaviorTest``, whose arguments it takes.

    The node is shut down at the end of the test.
    """
    from composer.testing import BehaviorTest

    yield from _opener(request, BehaviorTest)


@pytest.fixture
def system_test(request: pytest.FixtureRequest) -> Iterator[Callable[..., SystemTest]]:
    """Return a function that opens a ``SystemTest``, whose arguments it takes.

    The system is shut down at the end of the test.
    """
    from composer.testing import SystemTest

    yield from _opener(request, SystemTest)


def _opener(request: pytest.FixtureRequest, kind: Callable[..., Any]) -> Iterator[Any]:
    opened = request.node.stash.setdefault(_OPENED, [])
    with ExitStack() as stack:

        def open_test(*arguments: Any, **options: Any) -> Any:
            test = kind(*arguments, **options)
            opened.append(test)  # first: its start may fail
            return stack.enter_context(test)

        yield open_test


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Show what happened last if a test fails; a TestFailure does so itself."""
    report = yield
    if report.failed and call.excinfo is not None:
        for test in item.stash.get(_OPENED, ()):
            if not getattr(call.excinfo.value, "timeline", None):
                report.sections.append(("timeline of the last seconds", "\n".join(test.timeline())))
    return report
