"""What every test gets: a DDS domain of its own, and honest skips without ROS."""

from __future__ import annotations

import fcntl
import gc
import importlib.util
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TextIO

import pytest
from hypothesis import HealthCheck, settings

from composer.runtime.process.dds_participants import count_participants

TESTS_WITH_ROS = Path(__file__).parent / "ros"
PROFILE_OF_FAST_DDS = Path(__file__).with_name("udp_on_this_computer.xml")
NO_ROS = "rclpy cannot be imported"
# Domain 0 is where people's robots are; above 101 the ports meet Linux' ephemeral ones.
DOMAIN_IDS = range(1, 102)

# How long an example takes says how busy the machine is, and what it imports for the first time.
settings.register_profile("unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unhurried")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write what the golden tests get as what they expect; read the difference then",
    )
    parser.addoption("--soak", action="store_true", help="run what takes many minutes, too")


def pytest_configure(config: pytest.Config) -> None:
    # Hundreds of commands would compile the composer hundreds of times where nobody may keep what
    # they compile.
    if os.environ.pop("PYTHONDONTWRITEBYTECODE", None):
        folder = tempfile.TemporaryDirectory(prefix="bytecode-")
        config.add_cleanup(folder.cleanup)
        os.environ["PYTHONPYCACHEPREFIX"] = folder.name
    # What is started in the background of a script ignores SIGINT, and so would all that the
    # tests start: nobody could see whether they end at Ctrl-C.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _may_skip() -> bool:
    """Tell whether tests with ROS may be left out: never in CI, where green must mean tested."""
    return importlib.util.find_spec("rclpy") is None and os.environ.get("CI") != "true"


class _SkippedModule(pytest.Module):
    """A test file that is reported as skipped without being imported."""

    def collect(self) -> list[pytest.Item | pytest.Collector]:
        pytest.skip(NO_ROS, allow_module_level=True)


def pytest_pycollect_makemodule(
    module_path: Path, parent: pytest.Collector
) -> pytest.Module | None:
    if _may_skip() and module_path.is_relative_to(TESTS_WITH_ROS):
        return _SkippedModule.from_parent(parent, path=module_path)
    return None


def pytest_collection_finish() -> None:
    """Have the garbage collector look no more at thousands of tests and what they import."""
    gc.collect()
    gc.freeze()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption("--soak"):
        _leave_out(config, items, "soak")
    may_skip = _may_skip()
    for item in items:
        if item.path.is_relative_to(TESTS_WITH_ROS):
            item.add_marker(pytest.mark.ros)
        if may_skip and item.get_closest_marker("ros"):
            item.add_marker(pytest.mark.skip(reason=NO_ROS))


def _leave_out(config: pytest.Config, items: list[pytest.Item], marker: str) -> None:
    left_out = [item for item in items if item.get_closest_marker(marker)]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


#: Where tests of this process have been.
_visited: set[int] = set()


def pytest_runtest_logfinish() -> None:
    """Have what a test has left in cycles of references leave the ROS graph, and free its sockets.

    A lifecycle node of rclpy is one, with its participant; so is whatever an exception was raised
    in. This is the first moment at which nobody holds what the fixtures have made.
    """
    if any(count_participants(domain_id) for domain_id in _visited):
        gc.collect()
    _visited.clear()


def _hold_domain_id() -> tuple[int, TextIO]:
    """Take the domain id that has been free longest, of those no other test process here has.

    So what a killed process has left on the network does not meet the next tests. Neither do
    nodes that hang in one of the test processes: where anybody is, nobody is sent. The lock lasts
    as long as the returned file is open, however the process ends.
    """
    locks = Path(tempfile.gettempdir()) / f"ros2-composer-domain-ids-{os.getuid()}"
    locks.mkdir(exist_ok=True)

    def used_s(domain_id: int) -> float:
        lock = locks / str(domain_id)
        return lock.stat().st_mtime if lock.exists() else 0.0

    for domain_id in sorted(DOMAIN_IDS, key=used_s):
        lock = (locks / str(domain_id)).open("a", encoding="ascii")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.close()
            continue
        if count_participants(domain_id):
            lock.close()
            continue
        os.utime(lock.fileno())
        _visited.add(domain_id)
        return domain_id, lock
    pytest.exit(f"all {len(DOMAIN_IDS)} domain ids are taken by other processes", 3)


@contextmanager
def _environment_given_back() -> Iterator[None]:
    """Undo what changes; never all of it, for what still runs in this process may look."""
    before = dict(os.environ)
    yield
    for name in os.environ.keys() - before.keys():
        del os.environ[name]
    for name, value in before.items():
        if os.environ.get(name) != value:
            os.environ[name] = value


@contextmanager
def _domain() -> Iterator[int]:
    """Have a domain id, set for this process and for every process it starts.

    Nobody on another computer is met, and there is no shared memory. What a host of this process
    chooses meanwhile goes with the domain.
    """
    domain_id, lock = _hold_domain_id()
    with _environment_given_back(), pytest.MonkeyPatch.context() as environment, lock:
        environment.setenv("ROS_DOMAIN_ID", str(domain_id))
        # Shared memory is that of all domains, and outlives killed processes. A participant that
        # is destroyed right after one was killed may crash there, or wait for ever: Fast DDS locks
        # what its own listener is about to replace (SharedMemManager::Listener::close).
        environment.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(PROFILE_OF_FAST_DDS))
        environment.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SYSTEM_DEFAULT")
        if "AMENT_PREFIX_PATH" not in os.environ:  # the wheels do not set it, a sourced ROS does
            environment.setenv("AMENT_PREFIX_PATH", sys.prefix)
        yield domain_id
        os.utime(lock.fileno())  # free from now on


@pytest.fixture(scope="session")
def in_a_domain() -> Callable[[], AbstractContextManager[int]]:
    """What holds a domain id for the length of a block."""
    return _domain


@pytest.fixture(scope="module")
def shared_domain_id() -> Iterator[int]:
    """The domain id of all tests of a module, for what they share."""
    with _domain() as domain_id:
        yield domain_id


@pytest.fixture(autouse=True)
def ros_domain_id(request: pytest.FixtureRequest) -> Iterator[int]:
    """The domain id of this test.

    Its own: an endpoint of the test before that is still known would be counted, and a service of
    which half is known is not ready. Where tests share what runs, it is that of their module.
    """
    if "shared_domain_id" in request.fixturenames:
        yield request.getfixturevalue("shared_domain_id")
        return
    with _domain() as domain_id:
        yield domain_id
