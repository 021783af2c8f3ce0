"""Conditions: on which the calls of a function depend, and of what some visits have shown."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from composer.launch.variants import identifier, is_switch, mark

_MAXIMUM_LENGTH = 60
#: A value of each argument; None for any.
_Group = tuple[str | None, ...]


class Condition(NamedTuple):
    """What is true if a call is made, as code; "" if the call is always made."""

    code: str = ""
    opposite: str = ""

    @property
    def negated(self) -> Condition:
        """The opposite condition."""
        return Condition(self.opposite, self.code)

    def __str__(self) -> str:
        is_short = len(self.code) <= _MAXIMUM_LENGTH
        return self.code if is_short else f"{self.code[:_MAXIMUM_LENGTH]}..."


ALWAYS = Condition()


def conditions_of_calls(function: ast.AST) -> dict[ast.Call, Condition]:
    """Return the innermost condition of each call that may not be made.

    A call in an exception handler depends on an exception. What follows a branch that returns
    depends on its condition as well. A loop is not a condition.
    """
    return dict(_in_node(function, ALWAYS))


def _in_node(node: ast.AST, condition: Condition) -> Iterator[tuple[ast.Call, Condition]]:
    if isinstance(node, ast.Call) and condition != ALWAYS:
        yield node, condition
    for nodes, inner in _parts(node, condition):
        yield from _in_body(nodes, inner)


def _parts(node: ast.AST, condition: Condition) -> Iterator[tuple[Sequence[ast.AST], Condition]]:
    """Yield the parts of a node, each with its condition."""
    match node:
        case ast.If() | ast.While() | ast.IfExp():
            test = _condition(node.test)
            yield [node.test], condition
            yield _listed(node.body), test
            yield _listed(node.orelse), condition if isinstance(node, ast.While) else test.negated
        case ast.BoolOp():
            first = _condition(node.values[0])
            yield node.values[:1], condition
            yield node.values[1:], first.negated if isinstance(node.op, ast.Or) else first
        case ast.Try():
            yield node.body, condition
            for handler in node.handlers:
                caught = "an exception" if handler.type is None else _code(handler.type)
                yield handler.body, Condition(f"{caught} is raised")
            yield [*node.orelse, *node.finalbody], condition
        case ast.Match():
            yield [node.subject], condition
            for case in node.cases:
                matched = f"{_code(node.subject)} matches {_code(case.pattern)}"
                yield case.body, Condition(matched)
        case _:
            for _, value in ast.iter_fields(node):
                parts = value if isinstance(value, list) else [value]
                yield [part for part in parts if isinstance(part, ast.AST)], condition


def _in_body(
    nodes: Sequence[ast.AST], condition: Condition
) -> Iterator[tuple[ast.Call, Condition]]:
    for node in nodes:
        yield from _in_node(node, condition)
        if isinstance(node, ast.If) and not node.orelse and isinstance(node.body[-1], ast.Return):
            condition = _condition(node.test).negated


def _listed(nodes: ast.AST | Sequence[ast.AST]) -> Sequence[ast.AST]:
    return [nodes] if isinstance(nodes, ast.AST) else nodes


def _condition(test: ast.expr) -> Condition:
    """Return an expression as a condition; ``not not x`` is the same as ``x``."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return _condition(test.operand).negated
    return Condition(_code(test), _code(ast.UnaryOp(ast.Not(), test)))


def _code(node: ast.AST) -> str:
    return " ".join(ast.unparse(node).split())


def condition(visits: Sequence[Mapping[str, str]], present: Iterable[int]) -> dict[str, str]:
    """Return the condition of what is present in these visits; empty for all of them.

    The first visit has the defaults.
    """
    numbers = frozenset(present)
    names = [*visits[0]]
    for name in tuple(names):  # those that decide nothing
        fewer = [other for other in names if other != name]
        if _are_enough(fewer, visits, numbers):
            names = fewer
    if not names:
        return {}
    groups: dict[_Group, bool] = {tuple(item[name] for name in names): False for item in visits}
    for number in numbers:
        groups[tuple(visits[number][name] for name in names)] = True
    constants = {name: sorted({item[name] for item in visits} - {mark(name)}) for name in names}
    numbers_of_values = [len({item[name] for item in visits}) for name in names]
    there = _merged([group for group, is_there in groups.items() if is_there], numbers_of_values)
    absent = _merged(
        [group for group, is_there in groups.items() if not is_there], numbers_of_values
    )
    present_if = " or ".join(_terms(constants, there))
    absent_if = " or ".join(_terms(constants, absent))
    are_known = all(
        is_switch(constants[name]) or any(item[name] == mark(name) for item in visits)
        for name in names
    )
    if len(there) != len(absent):
        is_positive = len(there) < len(absent)
    elif are_known:
        is_positive = len(present_if) <= len(absent_if)
    else:  # what other values choose is not known: they have what the default has
        is_positive = 0 not in numbers
    return {"if": present_if} if is_positive else {"unless": absent_if}


def _are_enough(
    names: Sequence[str], visits: Sequence[Mapping[str, str]], present: frozenset[int]
) -> bool:
    """Return whether these arguments alone decide what is present."""
    found: dict[tuple[str, ...], bool] = {}
    return all(
        found.setdefault(tuple(item[name] for name in names), number in present)
        == (number in present)
        for number, item in enumerate(visits)
    )


def _merged(groups: Sequence[_Group], numbers_of_values: Sequence[int]) -> list[_Group]:
    """Return the groups with None in place of all values of an argument, if the rest is equal."""
    merged = [*groups]
    for position, number in enumerate(numbers_of_values):
        by_rest: dict[_Group, list[_Group]] = {}
        for group in merged:
            rest = (*group[:position], None, *group[position + 1 :])
            by_rest.setdefault(rest, []).append(group)
        merged = []
        for rest, same in by_rest.items():
            merged += [rest] if len(same) == number else same
    return merged


def _terms(constants: Mapping[str, Sequence[str]], groups: Iterable[_Group]) -> Iterator[str]:
    for group in groups:
        pairs = zip(constants, group, strict=True)
        yield " and ".join(
            _term(name, value, constants[name]) for name, value in pairs if value is not None
        )


def _term(name: str, value: str, constants: Sequence[str]) -> str:
    """Return a comparison; a mark is any value but the ``constants``."""
    variable = identifier(name)
    if value == mark(name):
        return " and ".join(f"{variable} != {_quoted(text)}" for text in constants)
    if is_switch(constants):
        return variable if value.lower() == "true" else f"not {variable}"
    return f"{variable} == {_quoted(value)}"


def _quoted(text: str) -> str:
    quote = '"' if "'" in text else "'"
    return f"{quote}{text}{quote}"
