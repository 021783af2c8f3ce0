"""How functions end."""

from __future__ import annotations

import ast

import pytest

from composer.python_code.source import Function
from composer.python_code.source.flow import reaches_end
from composer.rules.behaviors.blocking import endless_loops


def function(body: str) -> Function:
    text = "async def f():\n" + "".join(f"    {line}\n" for line in body.split("\n"))
    [found] = ast.parse(text).body
    assert isinstance(found, Function)
    return found


REACHES_END = [
    "pass",
    "if a:\n    return 1",
    "if a:\n    return 1\nelif b:\n    return 2",
    "for x in y:\n    return x",
    "while a:\n    return 1",
    "while True:\n    if a:\n        break",
    "while True:\n    for x in y:\n        pass\n    else:\n        break",
    "try:\n    return 1\nexcept E:\n    pass",
    "try:\n    pass\nexcept E:\n    return 1",
    "match a:\n    case 1:\n        return 1",
    "match a:\n    case _ if b:\n        return 1",
    "def g():\n    return 1",
]
ENDS_BEFORE = [
    "return 1",
    "raise E",
    "if a:\n    return 1\nelse:\n    raise E",
    "while True:\n    pass",
    "while True:\n    for x in y:\n        break",
    "with a:\n    return 1",
    "try:\n    return 1\nexcept E:\n    raise",
    "try:\n    pass\nfinally:\n    return 1",
    "try:\n    pass\nexcept E:\n    return 1\nelse:\n    return 2",
    "match a:\n    case 1:\n        return 1\n    case _:\n        return 2",
    "sys.exit()",
    "if a:\n    return 1\n" + "elif b:\n    return 2\n" * 900 + "else:\n    return 3",
    "assert False",
    "yield 1",
]


@pytest.mark.parametrize("body", REACHES_END)
def test_the_end_may_be_reached(body: str) -> None:
    assert reaches_end(function(body))


@pytest.mark.parametrize("body", ENDS_BEFORE)
def test_the_end_is_not_reached(body: str) -> None:
    assert not reaches_end(function(body))


ENDLESS = [
    "while True:\n    a = 1",
    "while 1:\n    pass",
    "while not self.ready:\n    pass",
    "while not goal.is_cancel_requested:\n    a = 1",
    "while True:\n    def g():\n        return 1",
]
ENDING = [
    "while True:\n    await a",
    "while True:\n    break",
    "while True:\n    return",
    "while True:\n    if a:\n        raise E",
    "while True:\n    async with a:\n        pass",
    "while True:\n    yield 1",
    "while a < b:\n    a += 1",
    "while not await a:\n    pass",
    "while True:\n    self.queue.get()",
]


@pytest.mark.parametrize("body", ENDLESS)
def test_endless_loops(body: str) -> None:
    assert [loop.lineno for loop in endless_loops(function(body))] == [2]


@pytest.mark.parametrize("body", ENDING)
def test_loops_that_end_or_wait(body: str) -> None:
    assert list(endless_loops(function(body))) == []
