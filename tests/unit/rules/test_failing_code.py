"""Code of behaviors that fails when it runs, and code like it that does not."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.behavior_code import found
from tests.unit.support.checking import diagnostics_in, quoted

SYSTEM = "system: a\nnodes:\n  n: {behavior: code:Code, timers: {tick: {period_ms: 100}}}\n"


@pytest.mark.parametrize(
    ("statement", "rule", "text"),
    [
        # values for several names
        ("a, b, c = 1, 2", "invalid-value", "1, 2"),
        ("self.a, self.b = [1.0]", "invalid-value", "[1.0]"),
        # operators
        ("'a' / 'b'", "invalid-value", "'a' / 'b'"),
        ("self.parameters.mode / 'log'", "invalid-value", "self.parameters.mode / 'log'"),
        ("'a' + [1]", "invalid-value", "'a' + [1]"),
        ("(1, 2) + [3]", "invalid-value", "(1, 2) + [3]"),
        ("{'a': 1} + {'b': 2}", "invalid-value", "{'a': 1} + {'b': 2}"),
        ("{1, 2} + {3}", "invalid-value", "{1, 2} + {3}"),
        ("self.parameters.speed & 1", "invalid-value", "self.parameters.speed & 1"),
        ("-self.parameters.names", "invalid-value", "-self.parameters.names"),
        ("-message.pose.pose.position", "invalid-value", "-message.pose.pose.position"),
        ("place = message.pose.pose.position\nplace += self.parameters.speed", "invalid-value",
         "self.parameters.speed"),
        # names of comprehensions and lambdas are others than those outside
        ("points = [p for p in Path().poses]\nmin((p for p in points), key=lambda p: p.w)",
         "unknown-field", "w"),
        ("p = Point()\n[p.z for p in self.parameters.names]", "unknown-field", "z"),
        ("p = Point()\n[p for p in self.parameters.names]\np.upper()", "unknown-field", "upper"),
        # values that may be None
        ("a, b = self.ends('a')", "unchecked-none", "self.ends('a')"),
        ("found = self.ends('a')\na, b = found", "unchecked-none", "found"),
        ("near = self.find('a')\nself.use(near)", "unchecked-none", "near"),
        ("near = self.find('a')\nself.use(point=near)", "unchecked-none", "near"),
        ("self.use(self.find('a'))", "unchecked-none", "self.find('a')"),
        ("PoseStamped().pose.position = self.find('a')", "unchecked-none", "self.find('a')"),
        ("high = self.highest()\nPoint(x=high)", "unchecked-none", "high"),
        ("high = self.highest()\n1.0 + high", "unchecked-none", "high"),
        # a name that its own new value is computed from
        ("place = PoseStamped()\nplace = self.use(place)", "call-arguments", "place"),
        # functions that are called with other arguments
        ("sorted(Path().poses, key=lambda: 1)", "call-arguments", "lambda: 1"),
        ("[1].sort(key=lambda a, b: a - b)", "call-arguments", "lambda a, b: a - b"),
        ("list(map(lambda a, b: a, [1]))", "call-arguments", "lambda a, b: a"),
        ("min([1], key=self.find_all)", "call-arguments", "self.find_all"),
        ("self.apply(lambda: 1.0)", "call-arguments", "lambda: 1.0"),
        ("self.apply(5)", "call-arguments", "5"),
        # attributes that are only computed from themselves
        ("self.phase = self.phase + 0.1\nself.phase.real", "unknown-attribute", "phase"),
        # 'except'
        ("try:\n    pass\nexcept [ValueError, KeyError]:\n    pass", "invalid-value",
         "[ValueError, KeyError]"),
        ("try:\n    pass\nexcept ValueError():\n    pass", "invalid-value", "ValueError()"),
        ("try:\n    pass\nexcept (ValueError, 'b'):\n    pass", "invalid-value", "'b'"),
        # calls
        ("self.scale(1.0, factor=2.0)", "call-arguments", "factor"),
    ],
)  # fmt: skip
def test_it_is_reported_once(statement: str, rule: str, text: str, tmp_path: Path) -> None:
    [diagnostic] = found("odometry", statement, tmp_path)
    assert (diagnostic.rule.name, quoted(diagnostic)) == (rule, text)


@pytest.mark.parametrize(
    "statement",
    [
        "a, b, *c = 1, 2\n(a, b), c = (1, 2), 3",
        "True * [1], [0] * self.count, '%d' % 1, 'a' * True, {1} - {2}, {1: 2} | {3: 4}",
        "b'a' + b'b', (1, 2) + (3,), [1] + ['a'], 1 / 0, -True, ~1, 1 << 2, 2 ** -1",
        "self.phase = self.phase + 0.1 if hasattr(self, 'phase') else 0.0\nself.phase.real",
        "try:\n    self.phase = self.phase + 1\nexcept AttributeError:\n    self.phase = 0",
        "try:\n    pass\nexcept (ValueError, (KeyError, OSError)):\n    pass",
        "self.apply(lambda value: value), self.apply(abs), self.apply(self.find)",
        "self.apply(lambda *values: 1.0), self.apply(lambda value, digits=2: value)",
        "list(map(lambda a, b: a, [1], [2])), sorted([1], key=str), min([1], key=self.find)",
        "a, b = 'ab'",
        "found = self.ends('a')\nif found is not None:\n    a, b = found",
        "place = Point()\nplace = self.use(place)\nplace + 1.0",
        "place = Point()\nfor _ in 'ab':\n    place = place.upper() if place else 'a'",
        "text = 5\nwhile text:\n    text = str(text).upper() or text.upper()",
        "text = self.parameters.names\ntext = text[0] if isinstance(text, list) else text.upper()",
        "longest = self.longest()\n'a' + longest",
        "near = self.find('a')\nif near:\n    self.use(near)",
        "near = self.find('a')\nself.show(near)\nself.keep(near)\nself.look(near)",
        "p = Point()\n[p.upper() for p in self.parameters.names]\np.x",
        "p = Point()\n[lambda p: p.upper() for p in Path().poses]\np.x",
        "[p.x for p in [q.pose.position for q in Path().poses]], [p for p in 'ab']",
        "(lambda p: p.upper())('a'), [p.pose for p in Path().poses]",
        "max(self.parameters.names, key=lambda p: p.upper())\np = Point()\np.x",
        "errors = ValueError, KeyError\ntry:\n    pass\nexcept errors:\n    pass",
    ],
)
def test_right_code_is_not_reported(statement: str, tmp_path: Path) -> None:
    assert found("odometry", statement, tmp_path) == []


@pytest.mark.parametrize(("field", "is_known"), [("pose", True), ("point", False)])
def test_a_transformed_message_has_the_type_of_the_message(
    field: str, is_known: bool, tmp_path: Path
) -> None:
    statement = f"self.transforms.transform(PoseStamped(), 'map').{field}"
    rules = {diagnostic.rule.name for diagnostic in found("odometry", statement, tmp_path)}
    assert ("unknown-field" not in rules) is is_known


@pytest.mark.parametrize(
    ("code", "line"),
    [
        # one attribute of a wrong type
        (
            "class Code:\n    def on_configure(self):\n        self.open = 5\n\n"
            "    def on_tick(self):\n        print(len(self.open))\n        self.show()\n\n"
            "    def show(self):\n        print(self.open[0], [item for item in self.open])\n",
            6,
        ),
        # a member that a class needs when the file is imported, and a method later
        (
            "from dataclasses import dataclass\nfrom enum import Enum\n\n\n"
            "class State(Enum):\n    IDLE = 1\n\n\n@dataclass\nclass Task:\n"
            "    state: State = State.QUEUED\n\n\nclass Code:\n"
            "    def on_tick(self):\n        print(Task().state is State.QUEUED)\n",
            11,
        ),
    ],
)
def test_one_cause_in_several_functions_is_reported_where_it_fails_first(
    code: str, line: int, tmp_path: Path
) -> None:
    (tmp_path / "code.py").write_text(code, encoding="utf-8")
    [diagnostic] = diagnostics_in(SYSTEM, tmp_path)
    assert diagnostic.primary.line == line
