"""Which calls in a handler are blocking, and which loops."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from composer.rules.behaviors import endless_loops
from tests.unit.support.checking import diagnostics_of_each, load_project

SYSTEM = "system: demo\nnodes:\n  a: {behavior: code:Code, timers: {tick: {period_ms: 1000}}}\n"

#: Statements, their imports, and whether they block.
STATEMENTS = [
    ("time.sleep(1.0)", "import time", True),
    ("sleep(1.0)", "from time import sleep", True),
    ("t.sleep(1.0)", "import time as t", True),
    ("input()", "", True),
    ("os.system('true')", "import os", True),
    ("run(['true'])", "from subprocess import run", True),
    ("subprocess.check_output(['true'])", "import subprocess", True),
    ("requests.get('http://robot')", "import requests", True),
    ("urlopen('http://robot')", "from urllib.request import urlopen", True),
    ("self.socket.recv(1024)", "", True),
    ("rclpy.spin_until_future_complete(self.node, future)", "import rclpy", True),
    ("self.executor.spin_until_future_complete(future)", "", True),
    ("self.plan_client.call(request)", "", True),
    ("self.helper()", "import time", True),
    ("[time.sleep(n) for n in (1, 2)]", "import time", True),
    ("self.clock.sleep(1.0)", "", False),
    ("self.clients.plan.call(request)", "", False),
    ("later(lambda: time.sleep(1.0))", "import time", False),
    ("self.queue.get_nowait()", "", False),
    ("self.input()", "", False),
    ("time.monotonic()", "import time", False),
    ("await asyncio.sleep(1.0)", "import asyncio", False),
]
CODE = """\
{imports}

class Code:
    {kind} on_tick(self):
        {statement}

    def helper(self):
        time.sleep(1.0)

    def unused(self):
        input()
"""


def test_calls_that_block_and_others(tmp_path: Path) -> None:
    projects = []
    for statement, imports, _ in STATEMENTS:
        kind = "async def" if "await" in statement else "def"
        code = CODE.format(imports=imports, kind=kind, statement=statement)
        projects.append({"system.yaml": SYSTEM, "code.py": code})
    for case, found in zip(STATEMENTS, diagnostics_of_each(projects, tmp_path), strict=True):
        messages = [item.message for item in found if item.rule.name == "blocking-call"]
        assert len(messages) == case[-1], case
        assert all(text.startswith("handler 'on_tick' of 'Code' blocks in '") for text in messages)


def test_a_call_reached_by_two_handlers_is_reported_once(tmp_path: Path) -> None:
    system = SYSTEM.replace("{period_ms: 1000}}", "{period_ms: 1000}, tock: {period_ms: 1000}}")
    handler = "    def on_{}(self):\n        self.ask()\n\n"
    code = f"class Code:\n{handler.format('tick')}{handler.format('tock')}"
    code += "    def ask(self):\n        input()\n"
    files = {"system.yaml": system, "code.py": code}
    [diagnostic] = load_project(tmp_path, files).diagnostics
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
