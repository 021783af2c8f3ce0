"""Commands in processes of their own, and a hand-written node for them to look at."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

COMPOSE = [sys.executable, "-m", "composer"]
TALKER = Path(__file__).with_name("hand_written_talker.py")
PATIENCE_S = 30.0


@contextmanager
def hand_written_talker() -> Iterator[None]:
    """Run the node ``/lab/talker`` for the length of the block."""
    process = subprocess.Popen([sys.executable, str(TALKER)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    # Fast DDS may print there first, about what a killed process left behind.
    assert "ready\n" in process.stdout
    yield
    process.kill()
    process.wait()


def compose(*arguments: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [*COMPOSE, *arguments], check=False, capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert done.returncode == code, done.stderr
    return done


def out(*arguments: str) -> str:
    return compose(*arguments).stdout


def start(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*COMPOSE, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def finished(process: subprocess.Popen[str]) -> str:
    """Return what a process that was started has printed, once it has ended well."""
    output, error = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, error
    return output


def listed(parts: tuple[str, ...], *arguments: str) -> str:
    """Ask again until all parts are found: on a busy machine discovery outlasts a command."""
    return asked_until(lambda text: all(part in text for part in parts), *arguments)


def measured(fits: Callable[[dict[str, Any]], bool], *arguments: str) -> dict[str, Any]:
    """Measure again until it fits: what else a machine does changes rates and ages for a while."""
    text = asked_until(lambda text: fits(json.loads(text.splitlines()[-1])), *arguments)
    found: dict[str, Any] = json.loads(text.splitlines()[-1])
    return found


def asked_until(fits: Callable[[str], bool], *arguments: str) -> str:
    """Return the first answer that fits, or the last one there is patience for."""
    until_s = time.monotonic() + PATIENCE_S
    while True:
        text = out(*arguments)
        if fits(text) or time.monotonic() > until_s:
            return text


def error(*arguments: str) -> str:
    done = compose(*arguments, code=1)
    assert done.stdout == ""
    return done.stderr
