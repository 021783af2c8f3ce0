"""Fixtures of all tests: DDS domains, the environment, and skips where ROS is missing."""

from __future__ import annotations

import faulthandler
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
from typing import Any, TextIO

import pytest

from composer.runtime.middleware.local_resources import count_participants
from tests.examples import register_profiles

TESTS = Path(__file__).parent
TESTS_WITH_ROS = TESTS / "ros"
WAITING_FILES = (TESTS_WITH_ROS, TESTS / "packaging")
#: These start no ROS node, so all of them share a domain.
TESTS_WITHOUT_NODES = (TESTS / "unit", TESTS / "golden", TESTS / "properties")
FAST_DDS_PROFILE = Path(__file__).with_name("udp_on_this_computer.xml")
#: Instead of faulthandler_timeout, for tests that may take half an hour.
SOAK_HANGS_AFTER_S = 1860.0
STDERR = pytest.StashKey[int]()
NO_ROS = "rclpy cannot be imported"
# Domain 0 is the default of real robots; the ports of ids above 101 are ephemeral ports on Linux.
DOMAIN_IDS = range(1, 102)

register_profiles()

#: Fixtures of folders that have nothing else in common.
pytest_plugins = ("tests.chromium",)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write the actual output as the expected output; review the difference afterwards",
    )
    parser.addoption(
        "--soak", action="store_true", help="also run the tests that take many minutes"
    )


def pytest_configure(config: pytest.Config) -> None:
    config.stash[STDERR] = os.dup(2)  # pytest captures it later
    config.add_cleanup(lambda: os.close(config.stash[STDERR]))
    # Without bytecode files, each worker would compile all tests, and each command the composer.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    _begin_elsewhere(config)
    # The logs of runs do not belong into the home folder of who runs the tests. Commands would find
    # the systems that another user runs on this computer by their locks.
    for variable in ("ROS_LOG_DIR", "XDG_RUNTIME_DIR"):
        folder = tempfile.TemporaryDirectory(prefix="compose-", ignore_cleanup_errors=True)
        config.add_cleanup(folder.cleanup)
        os.environ[variable] = folder.name
    # numpy, which every ROS process imports, would start a thread for each core.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # A background job of a script ignores SIGINT, and its children inherit that: tests could not
    # check whether programs stop at Ctrl-C.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _begin_elsewhere(config: pytest.Config) -> None:
    """Let each worker of xdist begin with other tests than the others when it collects all.

    So it finds the bytecode files that they have written, instead of compiling the same tests as
    they at the same time. ``_mix`` gives the tests the same order in all workers.
    """
    worker: dict[str, Any] | None = getattr(config, "workerinput", None)
    if worker is not None and config.args == config.getini("testpaths"):
        folders = sorted(
            str(path)
            for folder in (TESTS, TESTS / "ros", TESTS / "unit")
            for path in folder.iterdir()
            if path.is_dir() and path not in (TESTS / "ros", TESTS / "unit")
        )
        number = int(worker["workerid"].removeprefix("gw"))
        config.args[:0] = folders[number :: worker["workercount"]]


def _may_skip() -> bool:
    """Return whether tests with ROS may be skipped: never in CI."""
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
    """Keep the garbage collector from visiting thousands of tests and their modules."""
    gc.collect()
    gc.freeze()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    _mix(items)
    if not config.getoption("--soak"):
        _deselect(config, items, "soak")
    may_skip = _may_skip()
    with_ros = {
        path for path in {item.path for item in items} if path.is_relative_to(TESTS_WITH_ROS)
    }
    for item in items:
        if item.path in with_ros:
            item.add_marker(pytest.mark.ros)
        if may_skip and item.get_closest_marker("ros"):
            item.add_marker(pytest.mark.skip(reason=NO_ROS))


def _mix(items: list[pytest.Item]) -> None:
    """Spread the files that mostly wait evenly among those that mostly compute.

    With xdist's --no-loadscope-reorder, the workers run both kinds at all times. Those with slow
    tests come first: as the last one, such a file would run alone.
    """
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    files = sorted({item.path for item in items}, key=lambda path: (path not in slow, path))
    waiting = [path for path in files if any(map(path.is_relative_to, WAITING_FILES))]
    computing = [path for path in files if path not in waiting]
    place = {
        path: (number / len(group), number)
        for group in (waiting, computing)
        for number, path in enumerate(group)
    }
    items.sort(key=lambda item: (place[item.path], item.path))


def _deselect(config: pytest.Config, items: list[pytest.Item], marker: str) -> None:
    deselected = [item for item in items if item.get_closest_marker(marker)]
    if deselected:
        config.hook.pytest_deselected(items=deselected)
        items[:] = [item for item in items if item not in deselected]


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("soak"):
        stderr = item.config.stash[STDERR]
        faulthandler.dump_traceback_later(SOAK_HANGS_AFTER_S, exit=True, file=stderr)


#: The domain ids that the current test has used.
_used_domain_ids: set[int] = set()


def pytest_runtest_logfinish() -> None:
    """Collect nodes in reference cycles, so that their participants leave the ROS graph.

    rclpy's lifecycle nodes are in cycles, and so are nodes in the traceback of an exception. The
    fixtures have released them by now.
    """
    if any(count_participants(domain_id) for domain_id in _used_domain_ids):
        gc.collect()
    _used_domain_ids.clear()


def _lock_domain_id() -> tuple[int, TextIO]:
    """Return the least recently used domain id that is free, and its locked file.

    Participants that a killed process left behind have expired by the time an id is used again. An
    id with live participants, such as hanging nodes of another test process, is skipped. The lock
    lasts as long as the file is open, however the process ends.
    """
    locks = Path(tempfile.gettempdir()) / f"ros2-composer-domain-ids-{os.getuid()}"
    locks.mkdir(exist_ok=True)

    def last_used_s(domain_id: int) -> float:
        lock = locks / str(domain_id)
        return lock.stat().st_mtime if lock.exists() else 0.0

    for domain_id in sorted(DOMAIN_IDS, key=last_used_s):
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
        _used_domain_ids.add(domain_id)
        return domain_id, lock
    pytest.exit(f"all {len(DOMAIN_IDS)} domain ids are in use by other processes", 3)


@contextmanager
def _restored_environment() -> Iterator[None]:
    """Undo changes of the environment, one by one: other threads may read it meanwhile."""
    before = dict(os.environ)
    yield
    for name in os.environ.keys() - before.keys():
        del os.environ[name]
    for name, value in before.items():
        if os.environ.get(name) != value:
            os.environ[name] = value


@contextmanager
def _domain() -> Iterator[int]:
    """Set a domain id of its own for this process and the processes it starts.

    Participants use UDP on this computer only, without shared memory.
    """
    domain_id, lock = _lock_domain_id()
    with _restored_environment(), pytest.MonkeyPatch.context() as environment, lock:
        environment.setenv("ROS_DOMAIN_ID", str(domain_id))
        # All domains share the shared-memory segments, which outlive killed processes. A
        # participant that is destroyed right after another one was killed may crash or hang: Fast
        # DDS locks what its own listener is about to replace (SharedMemManager::Listener::close).
        environment.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(FAST_DDS_PROFILE))
        environment.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SYSTEM_DEFAULT")
        if "AMENT_PREFIX_PATH" not in os.environ:  # the wheels do not set it, a sourced ROS does
            environment.setenv("AMENT_PREFIX_PATH", sys.prefix)
        yield domain_id
        os.utime(lock.fileno())  # the id is free from now on


@pytest.fixture(scope="session")
def in_a_domain() -> Callable[[], AbstractContextManager[int]]:
    """A context manager that holds a domain id."""
    return _domain


@pytest.fixture(scope="session")
def session_domain_id() -> Iterator[int]:
    """The domain id of all tests without nodes."""
    with _domain() as domain_id:
        yield domain_id


@pytest.fixture(scope="module")
def shared_domain_id() -> Iterator[int]:
    """The domain id of all tests of a module, for nodes and processes that they share."""
    with _domain() as domain_id:
        yield domain_id


@pytest.fixture(autouse=True)
def ros_domain_id(request: pytest.FixtureRequest) -> Iterator[int]:
    """The domain id of this test.

    A test with nodes has its own. Otherwise endpoints of the previous test that are still known
    would be counted, and services that are half known would not be ready.
    """
    if any(map(request.path.is_relative_to, TESTS_WITHOUT_NODES)):
        domain_id = request.getfixturevalue("session_domain_id")
        with _restored_environment():
            yield domain_id
    elif "shared_domain_id" in request.fixturenames:
        yield request.getfixturevalue("shared_domain_id")
    else:
        with _domain() as domain_id:
            yield domain_id
