"""Fixtures and hooks of all tests: a separate ROS domain, and skips without ROS."""

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
# Domain 0 is used by other systems; ports of IDs above 101 collide with ephemeral ports.
DOMAIN_IDS = range(1, 102)

# The duration of an example depends on the load of the machine and on first-time imports.
settings.register_profile("unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unhurried")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="update the expected output of the golden tests",
    )
    parser.addoption("--soak", action="store_true", help="also run tests that take many minutes")


def pytest_configure(config: pytest.Config) -> None:
    # Without a bytecode cache, each of hundreds of commands would compile the composer.
    if os.environ.pop("PYTHONDONTWRITEBYTECODE", None):
        folder = tempfile.TemporaryDirectory(prefix="bytecode-")
        config.add_cleanup(folder.cleanup)
        os.environ["PYTHONPYCACHEPREFIX"] = folder.name
    # Background jobs of scripts ignore SIGINT, and child processes inherit this: restore the
    # default, so that tests can use Ctrl-C.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _may_skip() -> bool:
    """Return whether tests with ROS may be skipped without ROS, which CI does not allow."""
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
    """Exclude the collected tests and their imports from garbage collection."""
    gc.collect()
    gc.freeze()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption("--soak"):
        _deselect(config, items, "soak")
    may_skip = _may_skip()
    for item in items:
        if item.path.is_relative_to(TESTS_WITH_ROS):
            item.add_marker(pytest.mark.ros)
        if may_skip and item.get_closest_marker("ros"):
            item.add_marker(pytest.mark.skip(reason=NO_ROS))


def _deselect(config: pytest.Config, items: list[pytest.Item], marker: str) -> None:
    deselected = [item for item in items if item.get_closest_marker(marker)]
    if deselected:
        config.hook.pytest_deselected(items=deselected)
        items[:] = [item for item in items if item not in deselected]


#: Domain IDs that the current test has used.
_visited: set[int] = set()


def pytest_runtest_logfinish() -> None:
    """Collect reference cycles, so that their nodes leave the ROS graph and release sockets.

    Lifecycle nodes of rclpy and tracebacks contain reference cycles. Fixtures hold their objects
    until here.
    """
    if any(count_participants(domain_id) for domain_id in _visited):
        gc.collect()
    _visited.clear()


def _lock_domain_id() -> tuple[int, TextIO]:
    """Lock the least recently used domain ID without participants and return it.

    Leftovers of killed processes and nodes of blocked test processes thus do not affect other
    tests. The lock is held until the returned file is closed or the process exits.
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
    pytest.exit(f"all {len(DOMAIN_IDS)} domain IDs are used by other processes", 3)


@contextmanager
def _restored_environment() -> Iterator[None]:
    """Restore changed variables only, since other threads may read the environment."""
    before = dict(os.environ)
    yield
    for name in os.environ.keys() - before.keys():
        del os.environ[name]
    for name, value in before.items():
        if os.environ.get(name) != value:
            os.environ[name] = value


@contextmanager
def _domain() -> Iterator[int]:
    """Set a domain ID for this process and its child processes.

    Discovery is limited to this computer, and shared memory is disabled. Environment variables
    that a host sets in this process are restored at the end.
    """
    domain_id, lock = _lock_domain_id()
    with _restored_environment(), pytest.MonkeyPatch.context() as environment, lock:
        environment.setenv("ROS_DOMAIN_ID", str(domain_id))
        # Shared memory spans all domains and outlives killed processes. Destroying a participant
        # right after another one was killed can crash or deadlock: Fast DDS locks a mutex that its
        # own listener is about to replace (SharedMemManager::Listener::close).
        environment.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(PROFILE_OF_FAST_DDS))
        environment.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SYSTEM_DEFAULT")
        if "AMENT_PREFIX_PATH" not in os.environ:  # set by a sourced ROS, but not by the wheels
            environment.setenv("AMENT_PREFIX_PATH", sys.prefix)
        yield domain_id
        os.utime(lock.fileno())  # start of its idle time


@pytest.fixture(scope="session")
def in_a_domain() -> Callable[[], AbstractContextManager[int]]:
    """Return a context manager that locks a domain ID."""
    return _domain


@pytest.fixture(scope="module")
def shared_domain_id() -> Iterator[int]:
    """The domain ID that all tests of a module share."""
    with _domain() as domain_id:
        yield domain_id


@pytest.fixture(autouse=True)
def ros_domain_id(request: pytest.FixtureRequest) -> Iterator[int]:
    """The domain ID of this test.

    Each test has its own, since stale discovery data of a previous test would affect it. Tests of
    a module that share nodes share the domain ID, too.
    """
    if "shared_domain_id" in request.fixturenames:
        yield request.getfixturevalue("shared_domain_id")
        return
    with _domain() as domain_id:
        yield domain_id
