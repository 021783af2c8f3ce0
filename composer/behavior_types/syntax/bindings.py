"""What the names and attributes of a function are bound to, in no order."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import field
from enum import Enum
from functools import lru_cache

from composer.behavior_source import Function
from composer.behavior_source.traversal import walk
from composer.behavior_types.syntax.lambdas import lambdas_over
from composer.fast_dataclass import dataclass


class How(Enum):
    """How an expression determines the type of a name."""

    VALUE = "value"  # the name has this value
    ELEMENT = "element"  # the name is an element of this value
    ANNOTATION = "annotation"  # the expression is the annotation
    EXCEPTION = "exception"  # the name is an exception of this class
    CONTEXT = "context"  # the name is what 'with' gives for this value


@dataclass(frozen=True, slots=True)
class Binding:
    """One place that binds a name; an ``expression`` of None may be anything.

    ``positions`` are the places of the name in the tuples that are unpacked, outermost first.
    ``creates`` is false for a declaration of an attribute without a value.
    """

    expression: ast.expr | None = None
    how: How = How.VALUE
    creates: bool = True
    positions: tuple[int, ...] = ()
    is_inner: bool = False  # of a comprehension, which has names of its own
    value: ast.expr | None = None  # with an annotation

    @property
    def stored(self) -> ast.expr | None:
        """The whole value that is stored, None if it is not known."""
        if self.how is How.ANNOTATION:
            return self.value
        return self.expression if self.how is How.VALUE and not self.positions else None


@dataclass(slots=True)
class Bindings:
    """The bindings of the names in a function, and of the attributes of its first argument."""

    names: dict[str, list[Binding]] = field(default_factory=dict)
    attributes: dict[str, list[Binding]] = field(default_factory=dict)
    #: What '+=' and the like do to attributes, and to names.
    changes: dict[str, list[tuple[ast.operator, ast.expr]]] = field(default_factory=dict)
    name_changes: dict[str, list[tuple[ast.operator, ast.expr]]] = field(default_factory=dict)
    receiver: str | None = None
    #: The names that the function asks for their class, so that they are of several.
    distinguished: set[str] = field(default_factory=set)
    #: The names that the function asks for anything about their class, anywhere.
    asked: set[str] = field(default_factory=set)
    #: The arguments of lambdas that get the elements of a list.
    elements: dict[ast.AST, ast.expr] = field(default_factory=dict)
    #: The annotations of the arguments of functions within the function, by name.
    inner: dict[str, list[ast.expr | None]] = field(default_factory=dict)
    #: The bindings of names in comprehensions and in lambdas that get elements, by the id of a use.
    uses: dict[int, Binding] = field(default_factory=dict)
    _computed: dict[str, list[Binding]] | None = None

    def of_name(self, name: str) -> list[Binding]:
        """Return the bindings of a name outside comprehensions, or else those in them."""
        found = self.names.get(name, [])
        return [item for item in found if not item.is_inner] or found

    def value_of(self, name: str) -> ast.expr | None:
        """Return the value of a name that is bound once, and to a whole value; None for others."""
        bindings = self.names.get(name, [])
        only = bindings[0] if len(bindings) == 1 else None
        if only is None or only.how is not How.VALUE or only.positions:
            return None
        return only.expression

    def expressions_of(self, node: ast.expr | None) -> Iterator[ast.expr]:
        """Yield an expression, and those that the names in it are bound to, and so on."""
        pending = [node] if node is not None else []
        seen: set[str] = set()
        while pending:
            expression = pending.pop()
            yield expression
            names = {item.id for item in ast.walk(expression) if isinstance(item, ast.Name)}
            for name in names - seen:
                bound = (item.expression for item in self.names.get(name, ()))
                pending += [item for item in bound if item is not None]
            seen |= names

    @property
    def computed(self) -> dict[str, list[Binding]]:
        """The names that are set at first and then computed from themselves, by these bindings."""
        if self._computed is None:
            self._computed = {}
            for name in self.names:
                bindings = self.of_name(name)
                if len(bindings) > 1:
                    found = [item for item in bindings if self.reads(item.expression, name)]
                    if found and len(found) < len(bindings):
                        self._computed[name] = found
        return self._computed

    def reads(self, node: ast.expr | None, name: str) -> bool:
        """Return whether the value of an expression depends on a name of the function."""
        return any(
            isinstance(item, ast.Name) and item.id == name
            for expression in self.expressions_of(node)
            for item in ast.walk(expression)
        )

    def bind(
        self,
        target: ast.AST,
        expression: ast.expr | None,
        how: How = How.VALUE,
        positions: tuple[int, ...] = (),
        *,
        value: ast.expr | None = None,
    ) -> None:
        """Record that ``target`` is bound to ``expression``, or to an item within it.

        ``value`` is the value of a target with an annotation.
        """
        match target:
            case ast.Name(id=name):
                found = Binding(expression, how, positions=positions, value=value)
                self.names.setdefault(name, []).append(found)
            case ast.Attribute(value=ast.Name(id=name), attr=attribute) if name == self.receiver:
                found = Binding(expression, how, positions=positions, value=value)
                self.attributes.setdefault(attribute, []).append(found)
            case ast.Tuple(elts=targets) | ast.List(elts=targets):
                plain = how is How.VALUE and not positions
                values = _elements(expression, len(targets)) if plain else None
                for item, position in zip(targets, _positions(targets), strict=True):
                    if values is not None:
                        self.bind(item, values[position])
                    else:
                        self.bind(item, expression, how, (*positions, position))
            case ast.Starred(value=inner):
                self.bind(inner, None)

    def name(self, name: str | None) -> None:
        """Record that ``name`` is bound to something unknown."""
        if name is not None:
            self.names.setdefault(name, []).append(Binding())


@lru_cache(maxsize=512)
def bindings_of(function: Function, *, is_method: bool = True) -> Bindings:
    """Return the bindings in ``function`` and in the functions within it.

    If ``is_method``, the first argument is the behavior, except in a static method.
    """
    is_method = is_method and not is_static(function)
    arguments = (*function.args.posonlyargs, *function.args.args)
    # The object is not annotated; where it is, 'self' is missing.
    is_method = is_method and bool(arguments) and arguments[0].annotation is None
    found = Bindings(receiver=arguments[0].arg if is_method else None)
    for argument in arguments[1:] if is_method else arguments:
        found.bind(ast.Name(argument.arg), argument.annotation, How.ANNOTATION)
    for argument in function.args.kwonlyargs:
        found.bind(ast.Name(argument.arg), argument.annotation, How.ANNOTATION)
    for other in (function.args.vararg, function.args.kwarg):
        found.name(other.arg if other is not None else None)
    for node in nodes_of(function):
        _bind(node, found)
        if isinstance(node, _WITH_NAMES):
            _bind_uses(node, found)
    for name, inner in found.inner.items():
        # what the function around it calls the same may be something else
        is_only = len(inner) == 1 and name not in found.names
        for annotation in inner:
            if is_only and annotation is not None:
                found.bind(ast.Name(name), annotation, How.ANNOTATION)
            else:
                found.name(name)
    return found


def reads_attribute(node: ast.expr | None, receiver: str | None, name: str) -> bool:
    """Return whether an expression reads an attribute of the object of a method."""
    return node is not None and any(
        isinstance(item, ast.Attribute)
        and item.attr == name
        and isinstance(item.value, ast.Name)
        and item.value.id == receiver
        for item in ast.walk(node)
    )


def created_attributes(function: Function, found: Bindings | None = None) -> Iterator[str]:
    """Yield the attributes that a method assigns, without those that it only computes again.

    ``self.count = self.count + 1`` fails without ``self.count``, unless the method expects that.
    """
    found = bindings_of(function) if found is None else found
    updated = {
        name
        for name, bindings in found.attributes.items()
        if all(
            item.how is not How.ANNOTATION
            and reads_attribute(item.expression, found.receiver, name)
            for item in bindings
        )
    }
    expects = bool(updated) and any(
        isinstance(node, ast.ExceptHandler)
        or (isinstance(node, ast.Name) and node.id in {"getattr", "hasattr", "suppress", "vars"})
        for node in nodes_of(function)
    )
    yield from (name for name in found.attributes if expects or name not in updated)


#: Decorators that make a context for 'with' of a generator.
CONTEXTS = frozenset(
    {"asynccontextmanager", "contextlib.asynccontextmanager"}
    | {"contextlib.contextmanager", "contextmanager"}
)
#: Decorators that give a function with the same arguments. Others may give anything.
TRANSPARENT = CONTEXTS | {"classmethod", "final", "override", "staticmethod"}


def is_static(function: Function) -> bool:
    """Return whether a function is a static method, without the object as its first argument."""
    return any(
        isinstance(item, ast.Name) and item.id == "staticmethod" for item in function.decorator_list
    )


def is_class_method(function: Function) -> bool:
    """Return whether a function is a class method and has no other decorator."""
    match function.decorator_list:
        case [ast.Name(id="classmethod")]:
            return True
        case _:
            return False


@lru_cache(maxsize=512)
def nodes_of(function: Function) -> tuple[ast.AST, ...]:
    """Return the nodes in the body of ``function`` in source order, without nested classes."""
    return tuple(walk(function.body, closed=(ast.ClassDef,)))


def _bind(node: ast.AST, found: Bindings) -> None:
    match node:
        case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
            found.distinguished.update(_distinguished(test))
        case ast.Assign(targets=targets, value=value):
            for target in targets:
                found.bind(target, value)
        case ast.AnnAssign(target=target, annotation=annotation, value=annotated):
            found.bind(target, annotation, How.ANNOTATION, value=annotated)
        case ast.NamedExpr(target=target, value=value):
            found.bind(target, value)
        case ast.AugAssign(target=ast.Attribute(attr=attribute), op=operator, value=value):
            found.changes.setdefault(attribute, []).append((operator, value))
        case ast.AugAssign(target=ast.Name(id=name), op=operator, value=value):
            found.name_changes.setdefault(name, []).append((operator, value))
        case ast.For() | ast.AsyncFor():
            is_async = isinstance(node, ast.AsyncFor)
            found.bind(node.target, None if is_async else node.iter, How.ELEMENT)
        case ast.comprehension():
            for name, binding in _of_generators([node]).items():
                found.names.setdefault(name, []).append(binding)
        case ast.withitem(optional_vars=ast.expr() as target):
            found.bind(target, node.context_expr, How.CONTEXT)
        case ast.ExceptHandler(type=ast.expr() as caught, name=str() as name):
            found.bind(ast.Name(name), caught, How.EXCEPTION)
        case ast.ExceptHandler(name=name) | ast.MatchAs(name=name) | ast.MatchStar(name=name):
            found.name(name)
        case ast.MatchMapping(rest=name):
            found.name(name)
        case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
            found.name(name)
        case ast.Call():
            for argument, items in lambdas_over(node):
                found.elements[argument] = items
                bound = Binding(items, How.ELEMENT, is_inner=True)
                found.names.setdefault(argument.arg, []).append(bound)
            match node:
                case ast.Call(func=ast.Name(id=asking), args=[ast.Name(id=name), *_]):
                    found.asked.update({name} if asking in _ASKING else ())
        case ast.Match(subject=ast.Name(id=name)):
            found.asked.add(name)
        case ast.Try(body=body, handlers=handlers) if any(map(_tries, handlers)):
            names = (item for item in walk(body) if isinstance(item, ast.Name))
            found.asked.update(item.id for item in names)
        case ast.arg(arg=name, annotation=annotation) if node not in found.elements:
            # of a nested function or a lambda
            found.inner.setdefault(name, []).append(annotation)
        case ast.alias(name=name, asname=other):
            found.name(other or name.partition(".")[0])
        case ast.Global(names=names) | ast.Nonlocal(names=names):
            for name in names:
                found.name(name)
        case _:
            pass


def _of_generators(generators: list[ast.comprehension]) -> dict[str, Binding]:
    """Return the bindings of the names of a comprehension."""
    found = Bindings()
    for item in generators:
        found.bind(item.target, None if item.is_async else item.iter, How.ELEMENT)
    return {
        name: Binding(
            items[0].expression if len(items) == 1 else None,
            How.ELEMENT,
            positions=items[0].positions,
            is_inner=True,
        )
        for name, items in found.names.items()
    }


_WITH_NAMES = (ast.DictComp, ast.GeneratorExp, ast.Lambda, ast.ListComp, ast.SetComp)


def _bind_uses(node: ast.AST, found: Bindings) -> None:
    """Bind the uses of the names of a comprehension, or of a lambda that gets elements."""
    match node:
        case ast.ListComp() | ast.SetComp() | ast.DictComp() | ast.GeneratorExp():
            bindings: dict[str, Binding | None] = {**_of_generators(node.generators)}
            outside = {id(item) for item in walk([node.generators[0].iter])}
        case ast.Lambda(args=arguments):
            outside = set()
            bindings = {
                item.arg: Binding(found.elements[item], How.ELEMENT, is_inner=True)
                if item in found.elements
                else None
                for item in walk([arguments])
                if isinstance(item, ast.arg)
            }
        case _:
            return
    for item in walk([node]):
        if isinstance(item, ast.Name) and item.id in bindings and id(item) not in outside:
            binding = bindings[item.id]
            if binding is not None:
                found.uses[id(item)] = binding
            else:  # it is not that of a comprehension around it
                found.uses.pop(id(item), None)


def assigned_pairs(target: ast.expr, value: ast.expr) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Yield what an assignment stores where: each value of ``a, b = 1, 2`` with its target."""
    targets = target.elts if isinstance(target, ast.Tuple | ast.List) else []
    values = _elements(value, len(targets)) if targets else None
    if values is None or any(isinstance(item, ast.Starred) for item in targets):
        yield target, value
    else:
        yield from zip(targets, values, strict=True)


def _positions(targets: list[ast.expr]) -> list[int]:
    """Return the positions of the targets of a tuple; those after ``*`` count from its end."""
    starred = [index for index, item in enumerate(targets) if isinstance(item, ast.Starred)]
    first = starred[0] if starred else len(targets)
    return [index if index <= first else index - len(targets) for index in range(len(targets))]


def _elements(expression: ast.expr | None, count: int) -> list[ast.expr] | None:
    if not isinstance(expression, ast.Tuple | ast.List) or len(expression.elts) != count:
        return None
    if any(isinstance(item, ast.Starred) for item in expression.elts):
        return None
    return expression.elts


_ASKING = frozenset({"callable", "getattr", "hasattr", "isinstance", "issubclass", "type"})


def _tries(handler: ast.ExceptHandler) -> bool:
    """Return whether a handler expects a value of another class."""
    caught = walk([handler.type]) if handler.type is not None else ()
    return any(isinstance(item, ast.Name) and item.id in _OF_CLASSES for item in caught)


_OF_CLASSES = frozenset({"AttributeError", "TypeError"})


def _distinguished(test: ast.expr) -> Iterator[str]:
    """Yield the names whose class a condition asks for."""
    for node in walk([test]):
        match node:
            case ast.Call(func=ast.Name(id="isinstance" | "type"), args=[ast.Name(id=name), *_]):
                yield name
