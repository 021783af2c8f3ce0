"""Shapes of arrays: those that are read from code are those of the arrays that it makes."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import pytest

from composer.behavior_checks.operations.array_shapes import shape_of
from composer.behavior_source import find_behavior
from composer.behavior_types.inference import BehaviorTypes
from composer.loading import load_bytes
from tests.unit.support.checking import diagnostics_in, quoted

SYSTEM = """\
system: a
nodes:
  n:
    behavior: code:Code
    timers: {tick: {period_ms: 100}}
    parameters: {gains: {type: double_array, default: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]}}
    subscriptions: {scan: {type: sensor_msgs/msg/LaserScan, external: true, qos: sensor_data}}
    publishers: {imu: {type: sensor_msgs/msg/Imu, external: true, qos: command}}
"""
CODE = """\
import numpy as np
from composer.behavior import Behavior
from sensor_msgs.msg import Imu

WEIGHTS = np.array([0.2, 0.3, 0.5])


class Code(Behavior):
    def on_configure(self):
        self.gains = np.asarray(self.parameters.gains)
        self.matrix = np.eye(3)

    def on_scan(self, message):
        ranges = np.asarray(message.ranges)
        {scan}

    def on_tick(self):
        {tick}
"""
#: Statements that run, and how many of their names have a shape that is read.
STATEMENTS = [
    ("a = np.zeros((2, 3))\nb = a.T\nc = a @ b\nd = a[0]\ne = a[:, 1:]\nf = a[None, :]", 6),
    ("a = np.arange(12)\nb = a.reshape(3, 4)\nc = b.reshape(-1)\nd = b.reshape((2, -1))", 4),
    ("a = np.linspace(0.0, 1.0, 11)\nb = a[a > 0.5]\nc = np.diff(a)\nd = a[[1, 2]]\ne = a[::2]", 5),
    ("a = np.ones(4)\nb = a + 1\nc = a[:, np.newaxis] * a\nd = a.mean()\ne = a - d", 4),
    ("a = np.eye(3)\nb = np.linalg.inv(a) @ WEIGHTS\nc = a.sum(axis=1)\nd = a.max(axis=0)", 4),
    ("a = np.stack([WEIGHTS, WEIGHTS], axis=1)\nb = np.vstack([a, a])\nc = np.hstack([a, a])", 3),
    ("a = np.concatenate([WEIGHTS, np.zeros(2)])\nb = np.column_stack([WEIGHTS, WEIGHTS])", 2),
    ("a = np.concatenate([np.eye(3), np.eye(3)], axis=1)\nb = np.outer(WEIGHTS, np.ones(2))", 2),
    ("a = np.frombuffer(bytes(12), dtype=np.uint8)\na = a.reshape(2, 6)\na = a[:, :3]\nb = a", 2),
    ("a = np.where(WEIGHTS > 0.3, WEIGHTS, 0.0)\nb = np.clip(a, 0, 1)\nc = ~(a > 0.1)", 3),
    ("if WEIGHTS[0]:\n    a = np.zeros((2, 2))\nelse:\n    a = np.zeros((3, 2))\nb = a @ a.T", 2),
    ("a = [0.0] * 3\nb = np.array(a) * WEIGHTS\nc = [1.0, 2.0] + [3.0]\nd = np.array(c)", 4),
    ("a = np.zeros(3)\nfor i in range(2):\n    a = np.append(a, i)\nb = a", 0),
    ("a = 0.0\nfor w in [WEIGHTS, WEIGHTS]:\n    a += w\nb = a * 2", 0),
    ("a = np.zeros((2, 3))\na = a.mean(axis=0)\nb = a\na = np.atleast_2d(a)\nc = a", 1),
    ("a = np.zeros((2, 3))\na.shape = (3, 2)\nb = a", 0),
    ("a, b = np.zeros(2), np.eye(2)\nc = b.dot(a)\nd = np.dot(b, b)\ne = np.dot(a, a)", 2),
    ("a = np.sum(np.eye(3), axis=1, keepdims=True)\nb = np.mean(np.eye(3), axis=(0, 1))", 0),
    ("a = np.random.default_rng().normal(size=(3, 2))\nb = np.diag(WEIGHTS)\nc = np.diag(b)", 3),
    ("a = np.full((2, 2), 0.5)\nb = np.zeros_like(a)\nc = a.copy().ravel()\nd = a.flatten()", 4),
    ("a = np.transpose(np.zeros((2, 3)))\nb = a.transpose()\nc = np.cumsum(a)\nd = abs(a)", 3),
    ("a = np.array([(1.0, 2.0) for _ in range(3)])\nb = np.array([[1.0, 2.0], [3.0, 4.0]])", 2),
    ("a = (lambda b: b * 2)(WEIGHTS)\nb = np.zeros(2)\nc = [x + 1 for x in b]\nd = b", 2),
]  # fmt: skip


def _read(folder: Path, code: str) -> BehaviorTypes:
    (folder / "code.py").write_text(code, encoding="utf-8")
    loaded = load_bytes(SYSTEM.encode(), folder, shown="system.yaml")
    assert loaded.system is not None
    [node] = loaded.system.nodes
    assert node.behavior is not None
    types = BehaviorTypes(node, find_behavior(node.behavior), loaded.interfaces)
    types.infer()
    return types


@pytest.mark.parametrize(("statements", "count"), STATEMENTS)
def test_shapes_are_those_of_the_arrays(statements: str, count: int, tmp_path: Path) -> None:
    numpy = pytest.importorskip("numpy")
    names = sorted(set(re.findall(r"(?m)^ *([a-f])(?:, b)? = ", statements)))
    body = "\n".join([statements, *(f"{name}_ = {name}" for name in names)])
    code = CODE.replace("{scan}", "pass").replace("{tick}", body.replace("\n", "\n        "))
    types = _read(tmp_path, code)
    made: dict[str, Any] = {"np": numpy, "WEIGHTS": numpy.array([0.2, 0.3, 0.5])}
    exec(body, made)
    method = types.source.method("on_tick")
    assert method is not None
    assert method.node is not None
    scope = types.scope(method, types.source.own_modules[0])
    assert scope is not None
    known = 0
    for node in method.node.body:
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=value) if name.endswith("_"):
                shape = shape_of(value, scope)
                known += bool(shape)
                actual = numpy.shape(made[name])
                if shape is not None:
                    assert len(shape) == len(actual), name
                    assert all(x in (None, y) for x, y in zip(shape, actual, strict=True)), name
    assert known == count


@pytest.mark.parametrize(
    ("place", "statement", "rule", "text"),
    [
        ("tick", "np.eye(3) @ np.zeros((4, 2))", "invalid-value", "np.eye(3) @ np.zeros((4, 2))"),
        ("tick", "self.matrix @ self.gains", "invalid-value", "self.matrix @ self.gains"),
        ("tick", "WEIGHTS * np.zeros(4)", "invalid-value", "WEIGHTS * np.zeros(4)"),
        ("tick", "self.gains * WEIGHTS", "invalid-value", "self.gains * WEIGHTS"),
        ("tick", "WEIGHTS[3]", "index-out-of-range", "3"),
        ("tick", "np.eye(3)[:, 3]", "index-out-of-range", "3"),
        ("tick", "WEIGHTS[0, 1]", "index-out-of-range", "0, 1"),
        ("tick", "np.eye(3).shape[2]", "index-out-of-range", "2"),
        ("tick", "a, b, c = np.eye(3).shape", "invalid-value", "np.eye(3).shape"),
        ("tick", "np.stack([WEIGHTS, WEIGHTS], axis=2)", "invalid-value",
         "np.stack([WEIGHTS, WEIGHTS], axis=2)"),
        ("tick", "WEIGHTS.sum(axis=1)", "invalid-value", "WEIGHTS.sum(axis=1)"),
        ("tick", "np.mean(WEIGHTS, axis=1)", "invalid-value", "np.mean(WEIGHTS, axis=1)"),
        ("tick", "self.gains.reshape(2, 4)", "invalid-value", "self.gains.reshape(2, 4)"),
        ("tick", "self.gains.reshape((-1, 4))", "invalid-value", "self.gains.reshape((-1, 4))"),
        ("tick", "Imu().orientation_covariance = self.matrix", "invalid-value", "self.matrix"),
        ("scan", "rows = ranges.reshape(-1, 2)\nif rows[rows[:, 0] > 1]:\n    pass",
         "invalid-value", "rows[rows[:, 0] > 1]"),
        ("scan", "points = np.empty((len(ranges), 2))\npoints = points @ np.eye(2)\npoints(0)",
         "invalid-value", "points"),
        ("scan", "near = ranges[ranges < 1.0]\nnear = near + 1\nnear.size()", "invalid-value",
         "near.size"),
        ("scan", "np.arange(ranges)", "invalid-value", "np.arange(ranges)"),
    ],
)  # fmt: skip
def test_shapes_that_do_not_fit(
    place: str, statement: str, rule: str, text: str, tmp_path: Path
) -> None:
    code = CODE.replace(f"{{{place}}}", statement.replace("\n", "\n        "))
    code = code.replace("{scan}", "pass").replace("{tick}", "pass")
    (tmp_path / "code.py").write_text(code, encoding="utf-8")
    [diagnostic] = diagnostics_in(SYSTEM, tmp_path)
    assert diagnostic.rule.name == rule
    assert quoted(diagnostic) == text


@pytest.mark.parametrize(
    "statement",
    [
        "WEIGHTS[-3], np.eye(3)[2, 2], WEIGHTS[np.newaxis, 0], WEIGHTS[..., 0]",
        "np.eye(3) @ WEIGHTS, WEIGHTS @ np.eye(3), np.eye(3) @ [1.0, 2.0, 3.0]",
        "WEIGHTS * np.zeros((2, 3)), WEIGHTS + np.zeros(1), WEIGHTS[:, None] * np.zeros(4)",
        "[1.0, 2.0] + [3.0], [1.0] * 3, (1.0, 2.0) + (3.0,)",
        "self.gains.reshape(2, 3), self.gains.reshape(-1, 2), self.gains.reshape(3, -1, order='F')",
        "Imu().orientation_covariance = self.matrix.ravel()",
        "total = 0.0\nfor w in (WEIGHTS, WEIGHTS):\n    total += w\nif total.any():\n    pass",
        "rows, columns = self.matrix.shape\nself.matrix[rows - 1, columns - 1]",
        "place = (0, 1)\nif np.isinf(self.matrix[place]) or self.matrix[place] > 1:\n    pass",
        "m = self.matrix\nm = m[0]\nm[2], m @ WEIGHTS\nif m[0] > 1:\n    pass",
        "m = np.zeros(3)\nif WEIGHTS[0]:\n    m = np.zeros((3, 3))\n    m[0, 1]\nm[0]",
        "np.stack([WEIGHTS, WEIGHTS], axis=1), np.sum(WEIGHTS, axis=-1), WEIGHTS.max(axis=0)",
    ],
)
def test_shapes_that_fit(statement: str, tmp_path: Path) -> None:
    code = CODE.replace("{tick}", statement.replace("\n", "\n        ")).replace("{scan}", "pass")
    (tmp_path / "code.py").write_text(code, encoding="utf-8")
    assert diagnostics_in(SYSTEM, tmp_path) == []
