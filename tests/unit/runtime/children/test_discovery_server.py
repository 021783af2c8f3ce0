"""Whether a discovery server has something to do."""

from __future__ import annotations

import subprocess
import time

from composer.runtime.children.discovery_server import has_work


def test_a_process_has_work_until_it_waits_or_has_ended() -> None:
    script = "read line; while [ ! -e /nowhere ]; do :; done"
    with subprocess.Popen(["/bin/sh", "-c", script], stdin=subprocess.PIPE) as process:
        try:
            _until(process.pid, has_something_to_do=False)
            assert process.stdin is not None
            process.stdin.write(b"\n")
            process.stdin.flush()
            _until(process.pid, has_something_to_do=True)
        finally:
            process.kill()
    assert not has_work(process.pid)


def _until(pid: int, *, has_something_to_do: bool) -> None:
    until_s = time.monotonic() + 20.0
    while has_work(pid) is not has_something_to_do:
        assert time.monotonic() < until_s
