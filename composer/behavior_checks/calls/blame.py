"""Finds out whether a call or the function is wrong, for arguments without annotations."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator

from composer.behavior_checks.problems import CodeProblem, Kind, distinct
from composer.behavior_source import Function
from composer.behavior_source.flow import always_executed
from composer.behavior_source.spans import attribute_span, span_of
from composer.behavior_types.call_sites import CallSite, CallSites
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.values import NONE, Value
from composer.field_types import ANYTHING

#: The problems that a value of a wrong type causes.
_OF_TYPES = frozenset({Kind.ATTRIBUTE, Kind.CALL, Kind.FIELD, Kind.VALUE})
_DEEPEST = 4
_MOST_TYPES = 4

#: Returns all problems of a function, with these types of its arguments.
Check = Callable[[FunctionTypes], Iterable[CodeProblem]]


class Blame:
    """Moves problems from functions to the calls that cause them."""

    def __init__(self, calls: CallSites) -> None:
        """Look at the calls once all types are known."""
        self._calls = calls
        self._sites = calls.sites()

    def problems(
        self, function: Function, scope: FunctionTypes, check: Check
    ) -> Iterator[CodeProblem]:
        """Yield the problems of a function and of the calls that pass it wrong values."""
        found = list(check(scope))
        moved: list[CodeProblem] = []
        known = self._calls.functions.get(id(function))
        sites = self._sites.get(id(function), []) if known is not None else []
        for name in known.parameters if known is not None and sites else ():
            if name in scope.arguments:
                found, more = self._of_agreeing(name, function, scope, found, check)
            else:
                more = _of_differing(name, function, scope, sites, check)
            moved += more
        yield from distinct(found)
        yield from moved

    def _of_agreeing(
        self,
        name: str,
        function: Function,
        scope: FunctionTypes,
        found: list[CodeProblem],
        check: Check,
    ) -> tuple[list[CodeProblem], list[CodeProblem]]:
        """Return the problems that remain in a function, and those of its only call."""
        site = self._only(function, name)
        if site is None or not any(item.kind in _OF_TYPES for item in found):
            return found, []
        others = {_key(item) for item in check(_with(scope, name, ANYTHING))}
        caused = [item for item in found if _key(item) not in others]
        is_misspelled = any(map(_is_misspelled, caused))
        if not site.is_complete:  # another check reports the call
            return [item for item in found if item not in caused], []
        if not caused or is_misspelled or _is_used(name, function, scope, caused):
            return found, []
        argument, at = self._first(site, name)
        message = f"argument '{name}' of '{function.name}': {caused[0].message}"
        span = span_of(argument, at.scope.home.source)
        problem = CodeProblem(Kind.CALL, message, span)
        return [item for item in found if item not in caused], [problem]

    def _only(self, function: Function, name: str) -> CallSite | None:
        sites = self._sites.get(id(function), [])
        is_only = len(sites) == 1 and sites[0].given.get(name, (None, None))[0] is not None
        return sites[0] if is_only else None

    def _first(self, site: CallSite, name: str) -> tuple[ast.expr, CallSite]:
        """Return the argument that a value comes from: functions may only pass it on."""
        argument = site.given[name][0]
        for _ in range(_DEEPEST):
            around = site.scope.function
            if not isinstance(argument, ast.Name) or around is None:
                break
            known = self._calls.functions.get(id(around))
            is_passed_on = known is not None and argument.id in known.parameters
            if not is_passed_on or _loads(argument.id, around) > 1:
                break
            further = self._only(around, argument.id)
            if further is None:
                break
            site, argument = further, further.given[argument.id][0]
        return argument or site.call, site


def _of_differing(
    name: str, function: Function, scope: FunctionTypes, sites: list[CallSite], check: Check
) -> list[CodeProblem]:
    """Return the problems of the calls that pass another type than the others."""
    types: list[Value] = []
    for site in sites:
        type_ = site.given[name][1]
        if type_ is not ANYTHING and type_ is not NONE and type_ not in types:
            types.append(type_)
        if len(types) > _MOST_TYPES:
            return []
    certain = always_executed(function, lambda test: _is_of_others(test, name))
    if len(sites) < 2 or not certain:
        return []
    without = {_key(item) for item in check(_with(scope, name, ANYTHING))}
    wrong: list[tuple[Value, CodeProblem]] = []
    for type_ in types:
        caused = [item for item in check(_with(scope, name, type_)) if _key(item) not in without]
        caused = [item for item in caused if item.kind in _OF_TYPES]
        if caused and caused[0].span.line in certain:
            wrong.append((type_, caused[0]))
        elif caused:
            return []
    if len(wrong) == len(types) == len(sites):
        return []
    found: list[CodeProblem] = []
    for site in sites:
        argument, type_ = site.given[name]
        problem = next((item for other, item in wrong if other == type_), None)
        if problem is not None and argument is not None:
            message = f"argument '{name}' of '{function.name}': {problem.message}"
            span = span_of(argument, site.scope.home.source)
            found.append(CodeProblem(Kind.CALL, message, span))
    return found


def _with(scope: FunctionTypes, name: str, type_: Value) -> FunctionTypes:
    """Return the types in a function with another type of an argument."""
    arguments = {key: value for key, value in scope.arguments.items() if key != name}
    if type_ is not ANYTHING:
        arguments[name] = type_
    return FunctionTypes(
        scope.owner, scope.home, scope.bindings, arguments, scope.of_class, scope.function
    )


def _key(problem: CodeProblem) -> tuple[int, int, str]:
    return problem.span.line, problem.span.column, problem.message


def _loads(name: str, function: Function) -> int:
    return sum(isinstance(node, ast.Name) and node.id == name for node in nodes_of(function))


def _is_misspelled(problem: CodeProblem) -> bool:
    """Return whether a name is wrong, not the value; a letter is near to other letters."""
    hint = problem.hint or ""
    is_letter = problem.span.length == 1 and hint.startswith("valid here: x, ")
    return is_letter or hint.startswith("did you mean")


def _is_used(
    name: str, function: Function, scope: FunctionTypes, caused: list[CodeProblem]
) -> bool:
    """Return whether a function reads an attribute that the argument has."""
    wrong = {(item.span.line, item.span.column) for item in caused}
    for node in nodes_of(function):
        match node:
            case ast.Attribute(value=ast.Name(id=owner)) if owner == name:
                span = attribute_span(node, scope.home.source)
                if (span.line, span.column) not in wrong:
                    return True
    return False


def _is_of_others(test: ast.expr, name: str) -> bool:
    """Return whether a test is false for an argument of a wrong type."""
    match test:
        case ast.Compare(left=ast.Name(id=asked), ops=[ast.Is() | ast.Eq()], comparators=[other]):
            is_value = isinstance(other, ast.Constant) and other.value is not None
            return asked == name and not is_value
        case _:
            return False
