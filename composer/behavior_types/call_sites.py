"""The types of arguments without annotations, from the calls in the files of a behavior."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from composer.behavior_source import Function, Module
from composer.behavior_source.method_body import dotted
from composer.behavior_source.traversal import children
from composer.behavior_types.expressions.fillings import plain
from composer.behavior_types.syntax.bindings import (
    TRANSPARENT,
    bindings_of,
    is_class_method,
    is_static,
)
from composer.behavior_types.syntax.lineage import NAMED_TUPLE, PLAIN_BASES, lineage
from composer.behavior_types.syntax.own_classes import constructor_of
from composer.behavior_types.values import (
    NONE,
    ModuleFunction,
    OwnClass,
    OwnMethod,
    Value,
    join,
)
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING

if TYPE_CHECKING:
    from composer.behavior_types.expressions.function_types import FunctionTypes
    from composer.behavior_types.inference import BehaviorTypes

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass(frozen=True, slots=True, eq=False)
class OpenFunction:
    """A function with parameters that have no annotation: the names of these."""

    node: Function
    home: Module
    own: OwnClass | None
    parameters: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """A place that names a function; ``call`` is the call of it, None if it is used otherwise.

    ``function`` is the function around it, None at the top level of ``home``.
    """

    node: ast.expr
    call: ast.Call | None
    function: Function | None
    home: Module


@dataclass(frozen=True, slots=True, eq=False)
class CallSite:
    """A call of a function, with the types of what it passes to its open parameters."""

    call: ast.Call
    scope: FunctionTypes
    given: Mapping[str, tuple[ast.expr | None, Value]]
    #: Whether it passes all that is needed.
    is_complete: bool = True


class CallSites:
    """The calls of the functions without annotations in the files of a behavior."""

    def __init__(self, types: BehaviorTypes) -> None:
        """Look for the functions and what refers to them."""
        self._types = types
        self.functions = {id(item.node): item for item in _open_functions(types)}
        self._by_name: dict[str, list[OpenFunction]] = {}
        for item in self.functions.values():
            for name in _names_of(item, types):
                self._by_name.setdefault(name, []).append(item)
        modules = types.source.own_modules if self.functions else ()
        self._references = [
            reference
            for module in modules
            for name, found in references_in(module).items()
            if name in self._by_name
            for reference in found
        ]
        texts = frozenset().union(*map(_texts, modules))
        for name in texts & self._by_name.keys():
            self._drop(name)

    def _drop(self, name: str) -> None:
        for item in self._by_name[name]:
            self.functions.pop(id(item.node), None)

    def arguments(self) -> dict[int, dict[str, Value]]:
        """Return the types of the parameters whose calls all agree, by function and name."""
        found: dict[int, dict[str, Value]] = {}
        for key, sites in self.sites().items():
            for name in self.functions[key].parameters:
                types: Value = NONE
                for site in sites:
                    types = join(types, site.given[name][1])
                if types is not NONE and types is not ANYTHING:
                    found.setdefault(key, {})[name] = types
        return found

    def sites(self) -> dict[int, list[CallSite]]:
        """Return the calls of each function of which all calls are known, by its id."""
        found: dict[int, list[CallSite]] = {}
        unknown: set[int] = set()
        for reference in self._references:
            scope = scope_of(self._types, reference)
            value = scope.type_of(reference.node)
            target = _target(value)
            if target is None:
                if value is ANYTHING and not _is_other(reference, scope):
                    name = _last(reference.node)
                    unknown.update(id(item.node) for item in self._by_name[name])
                continue
            function, is_bound = target
            known = self.functions.get(id(function))
            if known is None:
                continue
            site = _site(known, reference.call, scope, is_bound=is_bound)
            if site is None:
                unknown.add(id(function))
            else:
                found.setdefault(id(function), []).append(site)
        return {key: sites for key, sites in found.items() if key not in unknown}


def scope_of(types: BehaviorTypes, reference: Reference) -> FunctionTypes:
    """Return the types around a reference."""
    function = reference.function
    if function is None:
        return types.at_module(reference.home)
    known = types.scopes.get(id(function))
    if known is not None:
        return known
    own = _classes_of(reference.home).get(id(function))
    return types.function(function, reference.home, own)


@lru_cache(maxsize=128)
def _classes_of(home: Module) -> dict[int, OwnClass]:
    """Return the classes of the methods in a file, by the id of the method."""
    return {
        id(method.node): OwnClass(known, home)
        for known in home.classes.values()
        for method in known.methods
        if method.node is not None
    }


def _open_functions(types: BehaviorTypes) -> Iterator[OpenFunction]:
    """Yield the functions that only the files themselves call."""
    own = {id(known) for _, known in types.source.classes}
    is_known = types.source.complete and not types.self_escapes
    for home in types.source.own_modules:
        for item in home.tree.body:
            if isinstance(item, _FUNCTIONS) and item.name not in home.repeated:
                yield from _opened(item, home, None)
        for known in home.classes.values():
            class_ = OwnClass(known, home)
            is_behavior = id(known) in own
            if not (is_known if is_behavior else _is_own(class_)):
                continue
            for method in known.methods:
                is_called_elsewhere = is_behavior and method.name.startswith(("on_", "accept_"))
                if method.node is None or is_called_elsewhere:
                    continue
                is_special = method.name.startswith("__") and method.name != "__init__"
                if not is_special and not (is_behavior and method.name == "__init__"):
                    opened = _opened(method.node, home, class_)
                    yield from (
                        item for item in opened if not _is_related(method.name, class_, types)
                    )


def _is_own(own: OwnClass) -> bool:
    """Return whether no other code calls the methods of a class."""
    others = lineage(own).others
    return others <= PLAIN_BASES | {NAMED_TUPLE} and not own.definition.node.keywords


def _is_related(name: str, own: OwnClass, types: BehaviorTypes) -> bool:
    """Return whether a class that is derived from another one, or its base, has the method too."""
    family = (*lineage(own).classes[1:], *types.project_classes.derived(own))
    return any(method.name == name for item in family for method in item.definition.methods)


def _opened(function: Function, home: Module, own: OwnClass | None) -> Iterator[OpenFunction]:
    if not {dotted(item) for item in function.decorator_list} <= TRANSPARENT:
        return
    arguments = function.args
    positional = [*arguments.posonlyargs, *arguments.args]
    skipped = 1 if own is not None and not is_static(function) else 0
    parameters = (*positional[skipped:], *arguments.kwonlyargs)
    open_names = [item.arg for item in parameters if item.annotation is None]
    if not open_names:
        return
    bindings = bindings_of(function, is_method=own is not None)
    names = tuple(
        name
        for name in open_names
        if name not in bindings.asked and len(bindings.names.get(name, ())) == 1
    )
    if names:
        yield OpenFunction(function, home, own, names)


def _names_of(item: OpenFunction, types: BehaviorTypes) -> Iterator[str]:
    """Yield the names that a function is called by: a constructor by those of its classes."""
    if item.node.name != "__init__" or item.own is None:
        yield item.node.name
        return
    yield "__init__"
    for own in (item.own, *types.project_classes.derived(item.own)):
        yield own.definition.name


def _target(value: Value) -> tuple[Function, bool] | None:
    """Return the function that a value calls, and whether its first argument is given."""
    match value:
        case OwnMethod(method=method) if method.node is not None:
            return method.node, not is_static(method.node)
        case ModuleFunction(node=function, is_bound=is_bound):
            return function, is_bound and not is_static(function)
        case OwnClass():
            found = constructor_of(value)
            return (found[0], True) if isinstance(found, tuple) else None
        case _:
            return None


def _is_other(reference: Reference, scope: FunctionTypes) -> bool:
    """Return whether a name is that of something in another module."""
    return bool(scope.global_name(dotted(reference.node))) if dotted(reference.node) else False


def _last(node: ast.expr) -> str:
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def _site(
    known: OpenFunction, call: ast.Call | None, scope: FunctionTypes, *, is_bound: bool
) -> CallSite | None:
    """Return what a call passes, None if that is not known."""
    if call is None or any(isinstance(item, ast.Starred) for item in call.args):
        return None
    if any(item.arg is None for item in call.keywords):
        return None
    arguments = known.node.args
    positional = [item.arg for item in (*arguments.posonlyargs, *arguments.args)]
    if is_bound or (known.own is not None and is_class_method(known.node)):
        positional = positional[1:]
    given: dict[str, ast.expr] = dict(zip(positional, call.args, strict=False))
    given.update({item.arg: item.value for item in call.keywords if item.arg is not None})
    found: dict[str, tuple[ast.expr | None, Value]] = {}
    is_complete = True
    for name in known.parameters:
        if name in given:
            found[name] = given[name], plain(scope.type_of(given[name]))
        else:
            default = _default(known.node, name)
            is_complete = is_complete and default is not None
            inside = scope.owner.at_module(known.home)
            type_ = inside.type_of(default) if default is not None else ANYTHING
            found[name] = None, plain(type_)
    return CallSite(call, scope, found, is_complete)


def _default(function: Function, name: str) -> ast.expr | None:
    arguments = function.args
    positional = [item.arg for item in (*arguments.posonlyargs, *arguments.args)]
    defaults = arguments.defaults
    with_default = dict(zip(positional[len(positional) - len(defaults) :], defaults, strict=True))
    names = [item.arg for item in arguments.kwonlyargs]
    return {**with_default, **dict(zip(names, arguments.kw_defaults, strict=True))}.get(name)


@lru_cache(maxsize=128)
def references_in(module: Module) -> dict[str, list[Reference]]:
    """Return the places of a file that name something, by the last part of the name."""
    found: dict[str, list[Reference]] = {}
    own: set[int] = {
        id(item)
        for known in module.classes.values()
        for method in known.methods
        if (item := method.node) is not None
    }
    own |= {id(item) for item in module.tree.body if isinstance(item, _FUNCTIONS)}
    pending: list[tuple[ast.AST, ast.AST | None, Function | None]] = [(module.tree, None, None)]
    while pending:
        node, parent, function = pending.pop()
        if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Load):
            is_called = isinstance(parent, ast.Call) and parent.func is node
            call = parent if is_called and isinstance(parent, ast.Call) else None
            if call is not None or not _only_names(node, parent):
                found.setdefault(_last(node), []).append(Reference(node, call, function, module))
        outside: list[ast.AST] = []
        if isinstance(node, _FUNCTIONS):
            outside = [*node.decorator_list, *node.args.defaults]
            outside += [item for item in node.args.kw_defaults if item is not None]
        pending += [(item, node, function) for item in outside]
        inside = node if isinstance(node, _FUNCTIONS) and id(node) in own else function
        for child in _evaluated(node):
            pending.append((child, node, inside))
    return found


def _evaluated(node: ast.AST) -> Sequence[ast.AST]:
    """Return the nodes below one, without annotations, and what belongs outside of a function."""
    match node:
        case ast.FunctionDef(body=body) | ast.AsyncFunctionDef(body=body):
            return [*body]
        case ast.AnnAssign(target=target, value=value):
            return [target] if value is None else [target, value]
        case ast.ClassDef(body=body, decorator_list=decorators):
            return [*decorators, *body]
        case ast.ExceptHandler(body=body):
            return [*body]
        case _:
            return children(node)


def _only_names(node: ast.expr, parent: ast.AST | None) -> bool:
    """Return whether a place names a class only to ask for it, or to read an attribute of it."""
    match parent:
        case ast.Call(func=ast.Name(id="isinstance" | "issubclass"), args=[_, other]):
            return other is node
        case ast.Attribute() | ast.Compare():
            return True
        case _:
            return False


@lru_cache(maxsize=128)
def _texts(module: Module) -> frozenset[str]:
    """Return what a file may call otherwise: names in texts, and imports under another name."""
    found: set[str] = set()
    for name, imported in module.imports.items():
        if imported.name and imported.name != name:
            found.add(imported.name)
    pending: list[ast.AST] = [module.tree]
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.add(node.value)
        pending += children(node)
    return frozenset(found)
