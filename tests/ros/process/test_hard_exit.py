"""A process ends in time even if a call into the middleware, or the end of Python, hangs."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path
from textwrap import dedent

import pytest

from tests.ros.support.commands import COMPOSE

PATIENCE_S = 60.0
#: Functions of rcl that never return, with the GIL held, if a variable names them.
HANGING_RCL = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void hang_in(const char *name)
{
  const char *hanging = getenv("HANG_IN");
  if (hanging && !strcmp(hanging, name) && write(2, "hanging\\n", 8)) {
    for (;;) pause();
  }
}

#define HANG(name) \\
  int name(void *a, void *b, void *c, void *d, void *e) \\
  { \\
    hang_in(#name); \\
    int (*real)() = dlsym(dlopen("librcl.so", RTLD_LAZY), #name); \\
    return real(a, b, c, d, e); \\
  }

HANG(rcl_node_init)
HANG(rcl_node_fini)
"""


@pytest.fixture(scope="module")
def hanging_rcl(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("hanging_rcl")
    source, library = folder / "hanging_rcl.c", folder / "libhanging_rcl.so"
    source.write_text(HANGING_RCL, encoding="utf-8")
    command = ["gcc", "-shared", "-fPIC", "-w", "-o", str(library), str(source), "-ldl"]
    subprocess.run(command, check=True)
    return library


def start(*arguments: object, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*COMPOSE, "run", *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
    )


def wait_for_line(process: subprocess.Popen[str], words: str) -> None:
    assert process.stderr is not None
    for line in process.stderr:
        if words in line:
            return
    raise AssertionError(f"it ended without '{words}'")


def rest_of(process: subprocess.Popen[str]) -> str:
    """Wait for the end; return the output since the last line that was read."""
    assert process.stderr is not None
    output = process.stderr.read()  # communicate() would skip lines that were read ahead
    process.wait(PATIENCE_S)
    return output


@pytest.mark.parametrize(
    ("function", "last_line", "said"),
    [
        # The start of a system gets at least 5 s.
        ("rcl_node_init", "hanging", ("Timeout (0:00:05)!", "manager/node.py")),
        ("rcl_node_fini", "1 of 1 nodes active", ("Timeout (0:00:01)!", "in destroy_node")),
    ],
)
def test_a_start_or_an_end_that_hangs_in_the_middleware_ends(
    hanging_rcl: Path, function: str, last_line: str, said: tuple[str, ...]
) -> None:
    hanging = {"LD_PRELOAD": str(hanging_rcl), "HANG_IN": function}
    process = start("minimal", "--grace", 1, **hanging)  # the default is 10 s
    wait_for_line(process, last_line)
    process.send_signal(signal.SIGTERM)
    output = rest_of(process)
    assert process.returncode == 1
    for part in said:  # and the Python stack
        assert part in output


def test_a_thread_of_a_behavior_does_not_delay_the_end(tmp_path: Path) -> None:
    path = tmp_path / "worker.yaml"
    path.write_text(
        "system: worker\nlifecycle: {timeout_ms: 1.0e+15}\n"  # longer than any timer of C
        'nodes: {worker: {behavior: "worker:Worker"}}\n'
    )
    path.with_suffix(".py").write_text(
        dedent(
            """
            import threading, time
            from composer.behavior import Behavior

            class Worker(Behavior):
                def on_activate(self):
                    threading.Thread(target=work_forever, daemon=False).start()

            def work_forever():
                while True:
                    time.sleep(0.1)
            """
        )
    )
    process = start(path, "--for", 0.1, "--grace", 1)
    wait_for_line(process, "shutting down: --for elapsed")
    output = rest_of(process)
    assert process.returncode == 1
    assert "Timeout (0:00:01)!" in output
    assert "in work_forever" in output
