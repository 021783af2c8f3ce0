"""Checks the classes in the files of a behavior: their definitions, the defaults of fields."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.class_definitions import definition_problems
from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Module
from composer.behavior_source.spans import span_of
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.syntax.own_classes import fields_of_class, is_dataclass
from composer.behavior_types.values import Collection, OwnClass

#: What a dataclass refuses as a default, because all of its objects would share it.
_SHARED = (dict, list, set)
_FIELD = "dataclasses.field"


def class_problems(types: BehaviorTypes) -> Iterator[CodeProblem]:
    """Yield the problems of the classes in the files of a behavior."""
    for home in types.source.own_modules:
        yield from definition_problems(home, types.project_classes)
        for definition in home.classes.values():
            own = OwnClass(definition, home)
            if is_dataclass(own):
                yield from _defaults(own, home, types)


def _defaults(own: OwnClass, home: Module, types: BehaviorTypes) -> Iterator[CodeProblem]:
    scope = types.at_module(home)
    for field in fields_of_class(own):
        value = field.value
        is_field = isinstance(value, ast.Call) and scope.called_name(value.func) == _FIELD
        options = {item.arg: item.value for item in getattr(value, "keywords", ())}
        made_by = options.get("default_factory") if is_field else None
        kind = kind_of(scope.type_of(made_by)) if made_by is not None else None
        if made_by is not None and kind not in (None, "function"):
            message = f"{shown(scope.type_of(made_by))} where a function is expected"
            yield CodeProblem(Kind.VALUE, message, span_of(made_by, home.source))
        value = options.get("default") if is_field else value
        found = scope.type_of(value) if value is not None else None
        if value is not None and isinstance(found, Collection) and found.python in _SHARED:
            name = found.python.__name__
            plain = not isinstance(value, ast.Call) and found.is_empty
            factory = name if plain else f"lambda: {ast.unparse(value)}"
            message = f"{shown(found)} cannot be the default of field '{field.name}'"
            hint = f"write field(default_factory={factory})"
            yield CodeProblem(Kind.VALUE, message, span_of(value, home.source), hint)
