"""``compose run`` in a separate process, and an external node to observe the system."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from textwrap import dedent
from typing import Any, TypeVar

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from tests.ros.support.forked import ForkedCommand
from tests.ros.support.service_calls import ServiceUser

T = TypeVar("T")

REPOSITORY = Path(__file__).resolve().parents[3]
#: Longer than a participant is known whose goodbye message was lost: 20 s.
PATIENCE_S = 60.0


def write_system(folder: Path, text: str, **modules: str) -> Path:
    """Write a system, and ``modules`` as Python files next to it; return its path."""
    for name, content in modules.items():
        folder.joinpath(f"{name}.py").write_text(dedent(content), encoding="utf-8")
    path = folder / "system.yaml"
    path.write_text(dedent(text), encoding="utf-8")
    return path


class RunningSystem:
    """``compose run`` in a separate process, with its output read continuously.

    It runs in a new interpreter if ``program`` is the command line of one.
    """

    def __init__(self, system: str, *options: str, program: Sequence[str] = ()) -> None:
        self.path = REPOSITORY / system
        command = ("run", system, *options)
        environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
        self.process = (
            subprocess.Popen(
                [*program, *command],
                cwd=REPOSITORY,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                text=True,
                env=environment,
            )
            if program
            else ForkedCommand(*command, merged=True, cwd=REPOSITORY, env=environment)
        )
        self.lines: list[str] = []
        self._has_ended = False
        self._changed = threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> RunningSystem:
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _traceback: object) -> None:
        self._end()
        self._reader.join()
        if error is not None:
            error.add_note("the system printed:\n" + self.output)

    @property
    def output(self) -> str:
        """The output so far."""
        return "\n".join(self.lines)

    def wait_for(self, pattern: str, timeout_s: float = PATIENCE_S) -> str:
        """Wait for a matching line of the output and return it. Fails on exit or timeout."""
        expression = re.compile(pattern)
        end_s = time.monotonic() + timeout_s
        with self._changed:
            while True:
                for line in self.lines:
                    if expression.search(line):
                        return line
                assert not self._has_ended, f"no line matches {pattern!r}, exit code {self._code()}"
                if not self._changed.wait(end_s - time.monotonic()):
                    raise AssertionError(f"no line matches {pattern!r} within {timeout_s:g} s")

    def stop(self, number: signal.Signals = signal.SIGINT) -> tuple[int, float]:
        """Send a signal; return the exit code and the time until the exit, in seconds."""
        sent_s = time.monotonic()
        self.process.send_signal(number)
        code = self.wait()
        return code, time.monotonic() - sent_s

    def wait(self) -> int:
        """Wait until the process ends and its output is read; return the exit code."""
        code = self.process.wait(timeout=PATIENCE_S)
        self._reader.join()
        return code

    def _end(self) -> None:
        """Stop the process; a killed one would stay in the ROS graph until its lease expires."""
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            with self._changed:
                self.lines.append(line.rstrip("\n"))
                self._changed.notify_all()
        with self._changed:
            self._has_ended = True
            self._changed.notify_all()

    def _code(self) -> int:
        return self.process.wait(timeout=PATIENCE_S)


class ExternalNode(ServiceUser):
    """A plain rclpy node that is external to the system."""

    def __init__(self, context: Context) -> None:
        super().__init__(Node("external_node", context=context))
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.node)

    def close(self) -> None:
        """Leave the ROS graph."""
        self.executor.shutdown(timeout_sec=1.0)
        self.node.destroy_node()

    def wait_until(self, condition: Callable[[], Any], what: str = "") -> None:
        self.spin_until(condition)

    def spin_until(self, condition: Callable[[], bool], timeout_s: float = PATIENCE_S) -> None:
        """Spin until the condition holds."""
        end_s = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > end_s:
                raise AssertionError(f"condition not met within {timeout_s:g} s")
            self.executor.spin_once(timeout_sec=0.05)

    def listen(self, message_type: Any, topic: str, qos: QoSProfile | int = 10) -> list[Any]:
        """Subscribe to a topic and return the list to which its messages are appended."""
        received: list[Any] = []
        self.node.create_subscription(message_type, topic, received.append, qos)
        return received

    def result(self, future: Any, timeout_s: float = PATIENCE_S) -> Any:
        """Wait for an rclpy future and return its result."""
        self.spin_until(future.done, timeout_s)
        return future.result()

    def wait_for_state(self, node: str, state: str) -> None:
        """Wait until the node has the state."""
        self.spin_until(lambda: self.state(node) == state)
