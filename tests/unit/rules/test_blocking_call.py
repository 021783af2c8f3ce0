"""Which calls in a handler are blocking, and which loops."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from composer.rules.behaviors import endless_loops
from tests.unit.support.checking import diagnostics_in, diagnostics_of_each

SYSTEM = "system: demo\nnodes:\n  a: {behavior: code:Code, timers: {tick: {period_ms: 1000}}}\n"

BLOCKING = {
    "time.sleep(1.0)": "import time",
    "sleep(1.0)": "from time import sleep",
    "t.sleep(1.0)": "import time as t",
    "input()": "",
    "os.system('true')": "import os",
    "run(['true'])": "from subprocess import run",
    "subprocess.check_output(['true'])": "import subprocess",
    "requests.get('http://robot')": "import requests",
    "urlopen('http://robot')": "from urllib.request import urlopen",
    "self.socket.recv(1024)": "",
    "rclpy.spin_until_future_complete(self.node, future)": "import rclpy",
    "self.executor.spin_until_future_complete(future)": "",
    "self.plan_client.call(request)": "",
    "self.helper()": "import time",
    "[time.sleep(n) for n in (1, 2)]": "import time",
}
FINE = {
    "self.clock.sleep(1.0)": "",
    "self.clients.plan.call(request)": "",
    "later(lambda: time.sleep(1.0))": "import time",
    "self.queue.get_nowait()": "",
    "self.input()": "",
    "time.monotonic()": "import time",
    "await asyncio.sleep(1.0)": "import asyncio",
}


def test_calls_that_block_and_others(tmp_path: Path) -> None:
    statements = BLOCKING | FINE
    projects = []
    for statement, imports in statements.items():
        kind = "async def" if "await" in statement else "def"
        code = (
            f"{imports}\n\n\nclass Code:\n    {kind} on_tick(self):\n        {statement}\n\n"
            "    def helper(self):\n        time.sleep(1.0)\n\n"
            "    def unused(self):\n        input()\n"
        )
        projects.append({"system.yaml": SYSTEM, "code.py": code})
    for statement, found in zip(statements, diagnostics_of_each(projects, tmp_path), strict=True):
        messages = [item.message for item in found if item.rule.name == "blocking-call"]
        assert len(messages) == (statement in BLOCKING), statement
        assert all(text.startswith("handler 'on_tick' of 'Code' blocks in '") for text in messages)


def test_a_call_reached_by_two_handlers_is_reported_once(tmp_path: Path) -> None:
    system = SYSTEM.replace("{period_ms: 1000}}", "{period_ms: 1000}, tock: {period_ms: 1000}}")
    methods = "".join(
        f"    def {name}(self):\n        self.ask()\n\n" for name in ("on_tick", "on_tock")
    )
    source = f"class Code:\n{methods}    def ask(self):\n        input()\n"
    (tmp_path / "code.py").write_text(source, encoding="utf-8")
    [diagnostic] = diagnostics_in(system, tmp_path)
    assert diagnostic.primary.line == 9


@pytest.mark.parametrize(
    ("body", "lines"),
    [
        ("while True:\n    a = 1", [2]),
        ("while 1:\n    pass", [2]),
        ("while not self.ready:\n    pass", [2]),
        ("while not goal.is_cancel_requested:\n    a = 1", [2]),
        ("while True:\n    def g():\n        return 1", [2]),
        # Loops that end or wait.
        ("while True:\n    await a", []),
        ("while True:\n    break", []),
        ("while True:\n    return", []),
        ("while True:\n    if a:\n        raise E", []),
        ("while True:\n    async with a:\n        pass", []),
        ("while True:\n    yield 1", []),
        ("while a < b:\n    a += 1", []),
        ("while not await a:\n    pass", []),
        ("while True:\n    self.queue.get()", []),
    ],
)
def test_endless_loops(body: str, lines: list[int]) -> None:
    text = "async def f():\n" + "".join(f"    {line}\n" for line in body.split("\n"))
    [function] = ast.parse(text).body
    assert [loop.lineno for loop in endless_loops(function)] == lines
