"""A process ends in time although a call into the middleware, or the end of Python, hangs."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path
from textwrap import dedent

import pytest

from tests.ros.support.commands import COMPOSE

PATIENCE_S = 30.0
#: rcl's functions, and those that never return when a variable names them: they hold the GIL then.
HANGING_RCL = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void hang_in(const char *name)
{
  const char *wanted = getenv("HANG_IN");
  if (wanted && !strcmp(wanted, name) && write(2, "hanging\\n", 8)) {
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
    """Wait for the end; return what was said since the line that was waited for."""
    assert process.stderr is not None
    said = process.stderr.read()  # communicate() would leave out what has been read ahead
    process.wait(PATIENCE_S)
    return said


def test_a_start_that_hangs_in_the_middleware_ends(hanging_rcl: Path) -> None:
    hanging = {"LD_PRELOAD": str(hanging_rcl), "HANG_IN": "rcl_node_init"}
    process = start("minimal", "--grace", 1, **hanging)
    wait_for_line(process, "hanging")
    began_s = time.monotonic()
    process.send_signal(signal.SIGTERM)
    said = rest_of(process)
    assert process.returncode == 1
    assert time.monotonic() - began_s < 9.0  # the start of a system gets 5 s at the least
    assert "manager.py" in said, "the Python stack says where"


def test_an_end_that_hangs_in_the_middleware_ends(hanging_rcl: Path) -> None:
    hanging = {"LD_PRELOAD": str(hanging_rcl), "HANG_IN": "rcl_node_fini"}
    process = start("minimal", "--grace", 1, **hanging)
    wait_for_line(process, "1 of 1 nodes active")
    began_s = time.monotonic()
    process.send_signal(signal.SIGTERM)
    said = rest_of(process)
    assert process.returncode == 1
    assert time.monotonic() - began_s < 5.0  # by default it gets 10 s
    assert "in destroy_node" in said


def test_a_thread_of_a_behaviour_does_not_hold_up_the_end(tmp_path: Path) -> None:
    path = tmp_path / "worker.yaml"
    path.write_text('system: worker\nnodes: {worker: {behavior: "worker:Worker"}}\n')
    path.with_suffix(".py").write_text(
        dedent(
            """
            import threading, time
            from composer.behavior import Behavior

            class Worker(Behavior):
                def on_activate(self):
                    threading.Thread(target=work_for_ever, daemon=False).start()

            def work_for_ever():
                while True:
                    time.sleep(0.1)
            """
        )
    )
    process = start(path, "--for", 0.1, "--grace", 1)
    wait_for_line(process, "stopping: 0.1 s are over")
    began_s = time.monotonic()
    said = rest_of(process)
    assert process.returncode == 1
    assert time.monotonic() - began_s < 5.0
    assert "in work_for_ever" in said
