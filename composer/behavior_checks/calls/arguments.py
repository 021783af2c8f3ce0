"""Checks the arguments of calls against the functions of a behavior, and against the API."""

from __future__ import annotations

import ast
import builtins
import importlib
import inspect
import math
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache

from composer import behavior
from composer.behavior_source import Function, Method
from composer.behavior_source.method_body import dotted
from composer.behavior_types.libraries.numpy_names import ndarray
from composer.behavior_types.libraries.rclpy_api import is_rclpy
from composer.behavior_types.syntax.bindings import CONTEXTS, is_class_method, is_static
from composer.behavior_types.syntax.lineage import PLAIN_BASES, lineage
from composer.behavior_types.syntax.own_classes import (
    OPTIONS_OF_FIELD,
    all_fields,
    constructor_of,
    is_dataclass,
    is_enumeration,
    known_attributes,
    misplaced_field,
)
from composer.behavior_types.values import ModuleFunction, OwnClass, OwnMethod, Value
from composer.diagnostics import suggestion
from composer.fast_dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Signature:
    """The parameters of a function, without ``self``.

    ``positional`` may be given by position or name, the first ``positional_only`` only by
    position, and ``keywords`` only by name. ``required`` have no default.
    """

    name: str
    positional: tuple[str, ...]
    keywords: tuple[str, ...]
    required: frozenset[str]
    positional_only: int = 0
    takes_more: bool = False  # *arguments
    takes_keywords: bool = False  # **arguments

    def bound(self, call: ast.Call) -> Iterator[tuple[str, ast.expr]]:
        """Yield the parameters that a call sets, each with its argument."""
        if not any(isinstance(argument, ast.Starred) for argument in call.args):
            yield from zip(self.positional, call.args, strict=False)
        for keyword in call.keywords:
            if keyword.arg is not None:
                yield keyword.arg, keyword.value

    def partial(self) -> Signature:
        """Return the parameters of a call that may leave out any of them."""
        return replace(self, required=frozenset())

    def problem(self, call: ast.Call) -> tuple[str, ast.expr | ast.keyword, str | None] | None:
        """Return why a call fails, the node that is wrong and a hint; None if it may be right."""
        unpacks = any(isinstance(argument, ast.Starred) for argument in call.args)
        unpacks_map = any(keyword.arg is None for keyword in call.keywords)
        if not unpacks and not self.takes_more and len(call.args) > len(self.positional):
            return self._too_many(call)
        names = (*self.positional[self.positional_only :], *self.keywords)
        for keyword in call.keywords:
            if keyword.arg is not None and keyword.arg not in names and not self.takes_keywords:
                message = f"'{self.name}' has no argument '{keyword.arg}'"
                return message, keyword, suggestion(keyword.arg, names)
        twice = self._twice(call) if not unpacks else None
        if twice is not None:
            return f"'{self.name}' gets the argument '{twice.arg}' twice", twice, None
        given = {name for name, _ in self.bound(call)}
        missing = [name for name in (*self.positional, *self.keywords) if name in self.required]
        missing = [name for name in missing if name not in given]
        if missing and not unpacks and not unpacks_map:
            listed = " and ".join(f"'{name}'" for name in missing)
            plural = "s" if len(missing) > 1 else ""
            return f"'{self.name}' needs the argument{plural} {listed}", call.func, None
        return None

    def accepts(self, count: int) -> bool:
        """Return whether a call with that many arguments, by position, succeeds."""
        if self.required & set(self.keywords):
            return False
        least = sum(name in self.required for name in self.positional)
        return least <= count <= (count if self.takes_more else len(self.positional))

    def _twice(self, call: ast.Call) -> ast.keyword | None:
        """Return the keyword of a parameter that an argument before it sets as well."""
        by_position = self.positional[self.positional_only : len(call.args)]
        return next((item for item in call.keywords if item.arg in by_position), None)

    def _too_many(self, call: ast.Call) -> tuple[str, ast.expr, str | None]:
        most = len(self.positional)
        takes = "no argument" if most == 0 else f"{most} argument{'s' if most > 1 else ''}"
        first = call.args[most]
        return f"'{self.name}' takes {takes}, not {len(call.args)}", first, None


def signature_of(function: Function, *, is_bound: bool, name: str = "") -> Signature | None:
    """Return the parameters of a function; None if a decorator may change them.

    If ``is_bound``, its first parameter is the object, except in a static method.
    """
    if is_static(function):
        is_bound = False
    elif not _keeps_signature(function, is_bound=is_bound):
        return None
    arguments = function.args
    positional = [argument.arg for argument in (*arguments.posonlyargs, *arguments.args)]
    without_default = len(positional) - len(arguments.defaults)
    required = positional[:without_default]
    required += [
        argument.arg
        for argument, default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
        if default is None
    ]
    first = 1 if is_bound else 0
    return Signature(
        name or function.name,
        tuple(positional[first:]),
        tuple(argument.arg for argument in arguments.kwonlyargs),
        frozenset(required) - frozenset(positional[:first]),
        max(len(arguments.posonlyargs) - first, 0),
        arguments.vararg is not None,
        arguments.kwarg is not None,
    )


_TRANSPARENT = CONTEXTS | {
    *("abc.abstractmethod", "abstractmethod", "final", "override", "typing.override"),
    *("cache", "functools.cache", "functools.lru_cache", "lru_cache"),
}


def _keeps_signature(function: Function, *, is_bound: bool) -> bool:
    """Return whether the decorators of a function leave its parameters as they are."""
    if is_bound and is_class_method(function):
        return True
    decorators = (
        item.func if isinstance(item, ast.Call) else item for item in function.decorator_list
    )
    return {dotted(item) for item in decorators} <= _TRANSPARENT


def constructor(own: OwnClass) -> Signature | None:
    """Return the parameters of the constructor of a class; None if they are not known."""
    name = own.definition.name
    if known_attributes(own) is None or is_enumeration(own):
        return None
    match constructor_of(own):
        case OwnClass():
            return _of_fields(own)
        case (function, _):
            return signature_of(function, is_bound=True, name=name)
    if is_rclpy(own.home):
        return None  # its description leaves out constructors that other methods call
    has_own = any(method.name == "__new__" for method in _methods(own))
    is_plain = lineage(own).others <= PLAIN_BASES and not is_dataclass(own)
    return Signature(name, (), (), frozenset()) if is_plain and not has_own else None


def _methods(own: OwnClass) -> Iterator[Method]:
    for known in lineage(own).classes:
        yield from known.definition.methods


def _of_fields(own: OwnClass) -> Signature | None:
    """Return the parameters that a dataclass or a named tuple has for its fields."""
    names: list[str] = []
    by_name: list[str] = []
    required: list[str] = []
    if misplaced_field(own) is not None:
        return None  # the class itself is wrong
    for field in all_fields(own):
        parameter = field.parameter
        if parameter is None:
            return None
        if parameter.is_taken:
            (by_name if parameter.by_name else names).append(field.name)
            required += [] if parameter.has_default else [field.name]
    name = own.definition.name
    return Signature(name, tuple(names), tuple(by_name), frozenset(required))


def signature_of_function(node: ast.expr, function: Value) -> Signature | None:
    """Return the parameters of what is passed as a function, None if they are not known."""
    match function, node:
        case OwnMethod(method=method), _ if method.node is not None and method.known:
            return signature_of(method.node, is_bound=True)
        case ModuleFunction(node=definition, is_bound=is_bound), _:
            return signature_of(definition, is_bound=is_bound)
        case OwnClass() as own, _:
            return constructor(own)
        case _, ast.Lambda(args=arguments):
            definition = ast.FunctionDef(
                name="lambda", args=arguments, body=[], decorator_list=[], lineno=1, col_offset=0
            )
            return signature_of(definition, is_bound=False)
        case _:
            return None


def fields_signature(own: OwnClass, name: str, *, first: bool) -> Signature | None:
    """Return the parameters of ``replace`` and the like: any of the fields, by name.

    If ``first``, the object is the first argument.
    """
    constructed = _of_fields(own)
    if constructed is None:
        return None
    names = (*constructed.positional, *constructed.keywords)
    return Signature(name, ("object",) if first else (), names, frozenset())


#: Methods whose signature Python does not report.
_WITHOUT_ARGUMENTS = frozenset({(deque, "pop"), (deque, "popleft"), (dict, "popitem")})


@cache
def method_signature(python: type, name: str) -> Signature | None:
    """Return the parameters of a method of a class of Python; None if they are not known."""
    if python is ndarray:
        return _of_array(name)
    if (python, name) in _WITHOUT_ARGUMENTS:
        return Signature(name, (), (), frozenset())
    if (python, name) == (dict, "update"):
        return Signature(name, ("other",), (), frozenset(), 1, takes_keywords=True)
    found = _signature(getattr(python, name, None), name)
    if found is None or not found.positional:
        return None
    first, *rest = found.positional
    return Signature(
        name,
        tuple(rest),
        found.keywords,
        found.required - {first},
        max(found.positional_only - 1, 0),
        found.takes_more,
        found.takes_keywords,
    )


#: Modules of the standard library whose functions have signatures.
_LIBRARY = frozenset(
    {"bisect", "colorsys", "copy", "glob", "heapq", "json", "operator", "os.path", "random"}
    | {"statistics", "struct", "textwrap"}
)
_BY_NAME: Mapping[str, Signature] = {
    "collections.deque": Signature("deque", ("iterable", "maxlen"), (), frozenset()),
    "collections.namedtuple": Signature(
        "namedtuple",
        ("typename", "field_names"),
        ("defaults", "module", "rename"),
        frozenset({"field_names", "typename"}),
    ),
    "dataclasses.field": Signature("field", (), tuple(sorted(OPTIONS_OF_FIELD)), frozenset()),
}


@cache
def library_signature(name: str) -> Signature | None:
    """Return the parameters of a built-in function or one of the library; None if unknown."""
    if name in _BY_NAME:
        return _BY_NAME[name]
    if name.startswith("numpy."):
        return _of_numpy(name, name.removeprefix("numpy."))
    module, _, last = name.rpartition(".")
    home = {"": builtins, "math": math}.get(module)
    if module in _LIBRARY:
        home = importlib.import_module(module)
    found = getattr(home, last, None)
    return None if isinstance(found, type) else _signature(found, name)


def _of_numpy(full: str, name: str) -> Signature | None:
    from composer.behavior_types.libraries.numpy_signatures import (  # noqa: PLC0415 (start-up time)
        NUMPY_ARRAYS,
        NUMPY_PARAMETERS,
    )

    count = NUMPY_ARRAYS.get(name)
    if count is not None:  # the next argument is where to store the result
        names = tuple(f"x{at + 1}" for at in range(count))
        return Signature(full, (*names, "out"), (), frozenset(names), takes_keywords=True)
    return _written(full, NUMPY_PARAMETERS.get(name))


def _of_array(name: str) -> Signature | None:
    from composer.behavior_types.libraries.numpy_signatures import (  # noqa: PLC0415 (start-up time)
        NUMPY_METHODS,
    )

    return _written(name, NUMPY_METHODS.get(name))


def _written(
    full: str, parameters: tuple[tuple[str, ...], tuple[str, ...]] | None
) -> Signature | None:
    """Return parameters that are written down; '=' follows optional ones."""
    if parameters is None:
        return None
    positional, keywords = parameters
    required = frozenset(item for item in (*positional, *keywords) if not item.endswith("="))
    return Signature(
        full,
        tuple(item.removesuffix("=") for item in positional),
        tuple(item.removesuffix("=") for item in keywords),
        required,
    )


def _signature(function: object, name: str) -> Signature | None:
    if not callable(function):
        return None
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return None
    kinds = inspect.Parameter
    by_position = {kinds.POSITIONAL_ONLY, kinds.POSITIONAL_OR_KEYWORD}
    return Signature(
        name,
        tuple(item.name for item in parameters if item.kind in by_position),
        tuple(item.name for item in parameters if item.kind is kinds.KEYWORD_ONLY),
        frozenset(
            item.name
            for item in parameters
            if item.default is kinds.empty and item.kind in (*by_position, kinds.KEYWORD_ONLY)
        ),
        sum(item.kind is kinds.POSITIONAL_ONLY for item in parameters),
        any(item.kind is kinds.VAR_POSITIONAL for item in parameters),
        any(item.kind is kinds.VAR_KEYWORD for item in parameters),
    )


@cache
def api_signature(class_name: str, method: str) -> Signature:
    """Return the parameters of a method of the API for behaviors."""
    parameters = inspect.signature(getattr(getattr(behavior, class_name), method)).parameters
    items = [item for name, item in parameters.items() if name != "self"]
    by_name = [item for item in items if item.kind is inspect.Parameter.KEYWORD_ONLY]
    return Signature(
        method,
        tuple(item.name for item in items if item not in by_name),
        tuple(item.name for item in by_name),
        frozenset(item.name for item in items if item.default is inspect.Parameter.empty),
    )
