"""Load-time variables: what is put in, where it then stands, and what is wrong."""

from __future__ import annotations

import time

import pytest

from composer.base.diagnostics import Diagnostic
from composer.language.expand import expand, missing_names
from composer.language.rules import MAX_DEPTH
from composer.language.tree import Entry, Mapping, Plain, Tree, plain
from tests.unit.support.resolving import tree_of

SECONDS_ALLOWED = 15.0


def arguments(text: str) -> dict[str, Entry]:
    return {entry.name: entry for entry in tree_of(text, "system")}


def expanded(text: str, given: str = "{}") -> tuple[Mapping, list[Diagnostic]]:
    return expand(tree_of(text), arguments(given))[:2]


def system(variables: str, value: str) -> str:
    return f"system: s\narguments: {variables}\nx: {value}"


def at_x(tree: Mapping) -> Tree:
    return tree.get("x")


#: Variables, a value that uses them, and the result.
VALUES = [
    # alone: the value, whatever it is
    ("{a: 1}", "${a}", 1),
    ("{a: 1.5}", "'${a}'", 1.5),
    ("{a: null}", "${a}", None),
    ("{a: [1, {b: 2}]}", "['${a}', 3]", [[1, {"b": 2}], 3]),
    ("{a: {default: {b: 1}}}", "{c: '${a}'}", {"c": {"b": 1}}),
    # inside a text: its text
    ("{a: 1, b: x}", "p/${a}/${b}", "p/1/x"),
    ("{a: 1.50, b: true, c: null}", "${a} ${b} ${c}", "1.5 true null"),
    ("{a: x}", "${a}${a}", "xx"),
    ("{a: x}", "${a} ", "x"),  # a blank at the end is none of YAML's
    ("{a: x}", "' ${a}'", " x"),
    # not variables
    ("{a: x}", "$${a}", "${a}"),
    ("{a: x}", "$${a} ${a}", "${a} x"),
    ("{a: x}", "$a {a} $ {a} ${a}", "$a {a} $ {a} x"),
    ("{a: '$${b}'}", "${a}", "${b}"),
    ("{a: '{message.data}'}", "'{count} ${a}'", "{count} {message.data}"),
    # of each other, in any order
    ("{a: '${b}', b: '${c}', c: 1}", "${a}", 1),
    ("{a: '${b}-${c}', b: x, c: '${b}'}", "${a}", "x-x"),
    ("{a: ['${b}', '${b}'], b: {default: {c: 1}}}", "${a}", [{"c": 1}, {"c": 1}]),
    # names that are keys, too
    ("{a: b}", "{'${a}_x': '${a}', '$${a}': 1}", {"b_x": "b", "${a}": 1}),
]
TYPE = "node: t\nvariables: {a: {description: d}, b: {default: '${c}'}, c: {default: 1}}\nx: "
#: A value in a node type, given values of its variables, and the result.
TYPE_VALUES = [
    ("'${a} ${b} ${c}'", "{}", "${a} 1 1"),
    ("${a}", "{}", "${a}"),
    ("'${a} ${b} ${c}'", "{a: x}", "x 1 1"),
    ("'${a} ${b} ${c}'", "{a: x, c: 2}", "x 2 2"),
    ("'${a} ${b} ${c}'", "{b: 3}", "${a} 3 1"),
    ("['${a}', '${b}', '${c}']", "{a: {y: 1}}", [{"y": 1}, 1, 1]),
    ("['${a}', '${b}', '${c}']", "{a: '$${a}', b: '${x}'}", ["$${a}", "${x}", 1]),
    ("['${a}', '${b}', '${c}']", "{a: null}", [None, 1, 1]),
]


@pytest.mark.parametrize(
    ("text", "given", "result"),
    [
        *((system(variables, value), "{}", result) for variables, value, result in VALUES),
        *((TYPE + value, given, result) for value, given, result in TYPE_VALUES),
        # A section of another shape has no diagnostics here.
        *((system(section, "${a}"), "{b: 1}", "${a}") for section in ("5", "[a]", "null")),
    ],
)
def test_value(text: str, given: str, result: Plain) -> None:
    tree, diagnostics = expanded(text, given)
    assert [item.message for item in diagnostics if item.rule.name != "unused-declaration"] == []
    assert repr(plain(at_x(tree))) == repr(result)


@pytest.mark.parametrize(
    ("text", "given", "missing"),
    [
        (TYPE + "1", "{}", ("a",)),
        (TYPE + "1", "{a: 1}", ()),
        (TYPE + "1", "{b: 1}", ("a",)),
        # A misspelled argument is not missing too.
        ("node: t\nvariables: {message_type: {}}\nx: ${message_type}", "{mesage_type: x}", ()),
    ],
)
def test_missing_names(text: str, given: str, missing: tuple[str, ...]) -> None:
    assert missing_names(tree_of(text), arguments(given)) == missing


def test_a_value_keeps_the_place_where_it_was_written_and_a_text_its_own() -> None:
    tree, _ = expanded("node: t\nvariables: {a: {}}\nx: ${a}", "{a: [1, two]}")
    second = at_x(tree).items[1]
    assert (str(second.span), str(second.part(1, 2))) == ("system:1:9", "system:1:10")
    tree, _ = expanded("node: t\nvariables: {a: {}}\nx: 'to ${a}'", "{a: longer}")
    value = at_x(tree)
    assert (str(value.span), value.verbatim) == ("f:3:4", False)
    assert value.part(3, 5) == value.span


def test_what_has_no_variables_stays_the_very_same() -> None:
    source = tree_of("system: s\nx: {y: [1, {z: text}]}")
    tree, diagnostics, *_ = expand(source, {})
    assert diagnostics == []
    assert at_x(tree) is at_x(source)


NOT_A_VARIABLE = "is not a variable"


@pytest.mark.parametrize(
    ("text", "rule", "place", "message", "hint"),
    [
        (system("{rate: 1}", "['${rate}', 'at ${rat}']"),
         "unknown-variable", "3:20", "there is no argument 'rat'", "did you mean 'rate'?"),
        # The misspelled one is not unused too.
        (system("{rate: 1}", "${rat}"), "unknown-variable", "3:4", "there is no", "'rate'?"),
        ("system: s\nx: ${a}", "unknown-variable", "2:4", "there is no argument 'a'", "declare it"),
        (system("{a: 1}", "['${a}', '${}']"),
         "malformed-variable", "3:14", f"'${{}}' {NOT_A_VARIABLE}: expected '${{name}}'", "'$${'"),
        (system("{a: 1}", "['${a}', '${a + 1}']"),
         "malformed-variable", "3:14", f"'${{a + 1}}' {NOT_A_VARIABLE}", "expression"),
        (system("{a: 1}", "['${a}', '${a']"),
         "malformed-variable", "3:14", f"'${{a' {NOT_A_VARIABLE}", ""),
        (system("{a: {default: {b: 1}}}", "at ${a}"),
         "malformed-variable", "3:7", "'${a}' is a map", ""),
        (system("{a: [1]}", "at ${a}"), "malformed-variable", "3:7", "'${a}' is a list", ""),
        (system("{a: '${a}'}", "1"), "cycle", "2:13", "argument 'a' is defined by itself", ""),
        (system("{a: 'x${b}', b: ['${c}'], c: '${a}', d: '${a}'}", "${d}"),
         "cycle", "2:13", "argument 'a' is defined by itself: a -> b -> c -> a", ""),
        (system("{a: 1, b: 2}", "${b}"),
         "unused-declaration", "2:13", "argument 'a' is never used", "'${a}'"),
    ],
)  # fmt: skip
def test_diagnostic(text: str, rule: str, place: str, message: str, hint: str) -> None:
    _, (diagnostic,) = expanded(text)
    assert (diagnostic.rule.name, str(diagnostic.primary)) == (rule, f"f:{place}")
    assert diagnostic.message.startswith(message)
    assert hint in (diagnostic.hint or "")


def test_unknown_argument() -> None:
    _, [found] = expanded("node: relay\nvariables: {type: {}}\nx: ${type}", "{tipe: 1}")
    assert (str(found.primary), found.message) == ("system:1:2", "'relay' has no variable 'tipe'")
    assert found.hint == "did you mean 'type'?"


def test_two_cycles_are_two_diagnostics() -> None:
    _, diagnostics = expanded(system("{a: '${b}', b: '${a}', c: '${d}', d: '${c}'}", "1"))
    cycles = [item.message.rpartition(": ")[2] for item in diagnostics]
    assert cycles == ["a -> b -> a", "c -> d -> c"]


def doubling(value: str, last: str) -> str:
    """Return a system whose variables each hold the next one twice, 60 times over."""
    lines = [f"  v{number}: {value.replace('NEXT', f'v{number + 1}')}" for number in range(60)]
    return "\n".join(["system: s", "arguments:", *lines, f"  v60: {last}", "x: ${v0}"])


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (doubling("'${NEXT}${NEXT}'", "laugh"), "f:"),
        (doubling("['${NEXT}', '${NEXT}']", "laugh"), "f:"),
        (doubling("{default: {a: '${NEXT}'}}", "1"), "f:"),
        (system("{a: [1, 2, 3, 4, 5, 6, 7, 8]}", "[" + "'${a}', " * 30_000 + "]"), "f:3:"),
    ],
    ids=["texts", "lists", "levels", "uses"],
)
def test_growth_is_bounded(text: str, place: str) -> None:
    tree = tree_of(text)
    started = time.process_time()
    result, diagnostics, *_ = expand(tree, {})
    assert time.process_time() - started < SECONDS_ALLOWED
    assert [item.rule.name for item in diagnostics] == ["too-large"]
    assert str(diagnostics[0].primary).startswith(place)
    assert result is tree


@pytest.mark.parametrize(("around", "fits"), [(MAX_DEPTH - 11, True), (MAX_DEPTH - 10, False)])
def test_depth(around: int, fits: bool) -> None:
    value = "[" * 10 + "]" * 10
    uses = "[" * around + "'${a}'" + "]" * around  # within the map that the file is
    _, diagnostics = expanded(system(f"{{a: {value}}}", uses))
    assert [item.rule.name for item in diagnostics] == ([] if fits else ["too-large"])


MANY = 20_000


@pytest.mark.slow  # 20 000 variables
@pytest.mark.parametrize(
    "text",
    [
        "system: s\narguments:\n"
        + "".join(f"  v{number}: '${{v{number + 1}}}'\n" for number in range(MANY))
        + f"  v{MANY}: 1\nx: ${{v0}}",
        "system: s\narguments:\n"
        + "".join(f"  v{number}: '${{v{(number + 1) % MANY}}}'\n" for number in range(MANY)),
        "system: s\narguments:\n"
        + "".join(f"  variable_{number}: 1\n" for number in range(MANY))
        + "x:\n"
        + "".join(f"  - ${{variabel_{number}}}\n" for number in range(MANY)),
        "system: s\nx: '" + "${" * 400_000 + "'",
        "system: s\nx: '" + "$${" * 300_000 + "'",
    ],
    ids=["a long chain", "a long circle", "many unknown", "many beginnings", "many escapes"],
)
def test_linear(text: str) -> None:
    tree = tree_of(text)
    started = time.process_time()
    _, diagnostics, *_ = expand(tree, {})
    assert time.process_time() - started < SECONDS_ALLOWED
    assert all(len(item.message) < 200 and len(item.related) < 10 for item in diagnostics)
