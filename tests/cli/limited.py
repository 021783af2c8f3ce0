"""Run ``compose``, then write its CPU time, memory and imports to a file descriptor as JSON.

It is started as a script, so that only the command is measured. Use of the network, or of another
child process than the type checker, ends it with a traceback.
"""

from __future__ import annotations

import json
import os
import re
import resource
import sys
import time
from pathlib import Path
from typing import Any

FORBIDDEN = ("socket.", "subprocess.", "os.exec", "os.posix_spawn", "os.system", "os.fork")


def watch(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "subprocess.Popen" and Path(os.fsdecode(arguments[0])).name == "pyrefly":
        return
    if event.startswith(FORBIDDEN):
        raise AssertionError(f"{event} was called")


def reference_s() -> float:
    """Return the CPU time of a fixed amount of work, which shows how fast the machine is."""
    began_s = time.process_time()
    seen: dict[str, list[int]] = {}
    for number in range(150_000):
        seen.setdefault(str(number % 1000), []).append(number)
    return time.process_time() - began_s


def report() -> dict[str, Any]:
    cpu_s = time.process_time()
    here = Path.cwd()
    # Not ru_maxrss, which starts with the peak of the parent process.
    peak = re.search(r"VmHWM:\s*(\d+)", Path("/proc/self/status").read_text())
    assert peak is not None
    files = [getattr(module, "__file__", None) for module in list(sys.modules.values())]
    return {
        "cpu_s": cpu_s,
        "reference_s": reference_s(),
        "peak_mb": int(peak[1]) / 1024,
        "imported": [file for file in files if file and Path(file).is_relative_to(here)],
    }


if __name__ == "__main__":
    from composer.cli import main

    descriptor = int(sys.argv.pop(1))
    sys.addaudithook(watch)
    resource.setrlimit(resource.RLIMIT_CPU, (20, 20))
    code = main(sys.argv[1:])
    os.write(descriptor, json.dumps(report()).encode())
    sys.exit(code)
