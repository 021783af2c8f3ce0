"""The attributes of classes in the files of a behavior, and of their objects."""

from __future__ import annotations

import ast
import dataclasses
import inspect
from collections.abc import Iterator
from functools import lru_cache

from composer.behavior_source import Class, Function, Module, links_version
from composer.behavior_source.method_body import dotted
from composer.behavior_source.traversal import walk
from composer.behavior_types.syntax.bindings import created_attributes
from composer.behavior_types.syntax.lineage import (
    ENUMS,
    NAMED_TUPLE,
    PLAIN_BASES,
    RECORDS,
    VALUE_BASES,
    decorator_name,
    decorators_of,
    exception_base,
    lineage,
)
from composer.behavior_types.syntax.self_attributes import defined_names
from composer.behavior_types.values import OwnClass
from composer.fast_dataclass import dataclass

_DATACLASS = "dataclasses.dataclass"
#: Decorators of classes that add no constructor and no attributes but those of objects.
_HARMLESS = frozenset(
    {"enum.unique", "functools.total_ordering", "typing.final", "typing.runtime_checkable"}
)
_OF_DATACLASSES = frozenset({"__dataclass_fields__", "__dataclass_params__", "__match_args__"})
_OF_NAMED_TUPLES = frozenset(
    {*dir(tuple), "_asdict", "_field_defaults", "_fields", "_make", "_replace"}
)


def known_attributes(owner: OwnClass) -> frozenset[str] | None:
    """Return all attributes of a class and of its objects; None if it may have others."""
    return _known_attributes(owner, links_version())


@lru_cache(maxsize=256)
def _known_attributes(owner: OwnClass, _version: int) -> frozenset[str] | None:
    family = lineage(owner)
    of_others = _attributes_of_others(family.others)
    if of_others is None:
        return None
    found = {*dir(object), *of_others}
    for own in family.classes:
        decorators = decorators_of(own)
        if decorators - _HARMLESS - {_DATACLASS} or not _has_plain_metaclass(own):
            return None
        found.update(_own(own.definition))
        found |= _OF_DATACLASSES if _DATACLASS in decorators else set()
    if {"__getattr__", "__getattribute__", "__setattr__"} & (found - {*dir(object)}):
        return None
    return frozenset(found)


def _attributes_of_others(bases: frozenset[str]) -> set[str] | None:
    """Return the attributes that classes of Python give to those derived from them."""
    found: set[str] = set()
    is_enum = not bases.isdisjoint(ENUMS)
    for base in bases - PLAIN_BASES:
        exception = exception_base(base)
        if base in ENUMS:
            found |= {*dir(ENUMS[base]), "name", "value"}
        elif base == NAMED_TUPLE:
            found |= _OF_NAMED_TUPLES
        elif is_enum and base in VALUE_BASES:
            found |= {*dir(VALUE_BASES[base])}
        elif exception is not None:
            found |= {*dir(exception)}
        else:
            return None
    return found


def _has_plain_metaclass(own: OwnClass) -> bool:
    for keyword in own.definition.node.keywords:
        name = decorator_name(keyword.value, own.home)
        if keyword.arg != "metaclass" or name != "abc.ABCMeta":
            return False
    return True


@dataclass(frozen=True, slots=True)
class ClassField:
    """A field of a dataclass or of a named tuple; ``value`` is its default, if it has one."""

    name: str
    annotation: ast.expr
    value: ast.expr | None
    home: Module
    by_name: bool = False

    @property
    def parameter(self) -> FieldParameter | None:
        """How the constructor takes the field, None if that is not known."""
        match self.value:
            case ast.Call(func=function, keywords=keywords) if (
                dotted(function).rpartition(".")[2] == "field"
            ):
                options = {item.arg: item.value for item in keywords}
            case _:
                return FieldParameter(has_default=self.value is not None, by_name=self.by_name)
        is_taken, by_name = options.get("init"), options.get("kw_only")
        if options.keys() - OPTIONS_OF_FIELD or not isinstance(is_taken, ast.Constant | None):
            return None
        return FieldParameter(
            has_default=bool({"default", "default_factory"} & options.keys()),
            by_name=self.by_name if by_name is None else bool(getattr(by_name, "value", True)),
            is_taken=is_taken is None or bool(is_taken.value),
        )


@dataclass(frozen=True, slots=True)
class FieldParameter:
    """How the constructor of a dataclass takes a field, if it does."""

    has_default: bool
    by_name: bool = False
    is_taken: bool = True


#: The parameters of ``dataclasses.field``.
OPTIONS_OF_FIELD = frozenset(inspect.signature(dataclasses.field).parameters)


def has_fields(owner: OwnClass) -> bool:
    """Return whether the constructor of a class takes the fields of a dataclass or named tuple."""
    return isinstance(constructor_of(owner), OwnClass)


def constructor_of(owner: OwnClass) -> OwnClass | tuple[Function, OwnClass] | None:
    """Return the dataclass or named tuple, or the method, that determines how to create objects.

    The method is ``__init__``, with its class. None: it is not known, or there is none.
    """
    for own in lineage(owner).classes:
        methods = {method.name: method.node for method in own.definition.methods}
        if "__new__" in methods:
            return None
        if "__init__" in methods:
            function = methods["__init__"]
            return (function, own) if function is not None else None
        if is_dataclass(own):
            return own if _makes_constructor(own) else None
        if is_named_tuple(own):
            return own
    return None


def _makes_constructor(own: OwnClass) -> bool:
    return not _options(own).keys() & {"init", None}


def is_dataclass(owner: OwnClass) -> bool:
    """Return whether a class is a dataclass."""
    return _DATACLASS in decorators_of(owner)


def fields_of_class(owner: OwnClass) -> Iterator[ClassField]:
    """Yield the fields that a dataclass or a named tuple itself declares, in order."""
    by_name = _all_by_name(owner)
    for statement in owner.definition.node.body:
        match statement:
            case ast.AnnAssign(target=ast.Name(id=name), annotation=annotation, value=value):
                text = ast.unparse(annotation)
                if text.endswith("KW_ONLY"):
                    by_name = True
                elif "ClassVar" not in text:
                    yield ClassField(name, annotation, value, owner.home, by_name)


def all_fields(owner: OwnClass) -> tuple[ClassField, ...]:
    """Return the fields that objects of a dataclass or a named tuple are created with."""
    found: dict[str, ClassField] = {}
    for own in lineage(owner).classes[::-1]:
        if is_dataclass(own) or is_named_tuple(own):
            found.update((item.name, item) for item in fields_of_class(own))
    return tuple(found.values())


def misplaced_field(owner: OwnClass) -> ClassField | None:
    """Return the first field that must have a default, because the one before it has; or None."""
    if not (is_dataclass(owner) or is_named_tuple(owner)):
        return None
    if is_dataclass(owner) and not _makes_constructor(owner):
        return None
    has_default = False
    for field in all_fields(owner):
        parameter = field.parameter
        is_placed = parameter is not None and parameter.is_taken and not parameter.by_name
        if parameter is None or not is_placed or "InitVar" in ast.unparse(field.annotation):
            continue
        if not parameter.has_default and has_default:
            return field
        has_default = has_default or parameter.has_default
    return None


def is_frozen(owner: OwnClass) -> bool:
    """Return whether objects of a class refuse that their attributes are set."""
    option = _options(owner).get("frozen")
    is_set = isinstance(option, ast.Constant) and option.value is True
    return is_named_tuple(owner) or (is_dataclass(owner) and is_set)


def abstract_methods(owner: OwnClass) -> list[str]:
    """Return the abstract methods that keep objects of a class from being created."""
    family = lineage(owner)
    is_abstract = "abc.ABC" in family.others or any(
        own.definition.node.keywords for own in family.classes
    )
    if not is_abstract or not family.others <= PLAIN_BASES or known_attributes(owner) is None:
        return []
    abstract: dict[str, None] = {}
    others: set[str] = set()
    for own in family.classes:
        for statement in own.definition.node.body:
            if isinstance(statement, Function):
                decorators = {decorator_name(item, own.home) for item in statement.decorator_list}
                if "abc.abstractmethod" in decorators:
                    abstract[statement.name] = None
                else:
                    others.add(statement.name)
            else:
                others.update(defined_names(statement))
    return [name for name in abstract if name not in others]


def _all_by_name(own: OwnClass) -> bool:
    option = _options(own).get("kw_only")
    return bool(option.value) if isinstance(option, ast.Constant) else option is not None


def _options(own: OwnClass) -> dict[str | None, ast.expr]:
    """Return the keyword arguments of the decorators of a class; None is that of ``**``."""
    decorators = own.definition.node.decorator_list
    return {item.arg: item.value for node in decorators for item in getattr(node, "keywords", ())}


def defines(owner: OwnClass, name: str) -> bool:
    """Return whether a class of the project, or one that it is derived from, has a method."""
    family = lineage(owner).classes
    return any(method.name == name for own in family for method in own.definition.methods)


def is_enumeration(owner: OwnClass, *bases: str) -> bool:
    """Return whether a class is an enumeration, derived from one of ``bases`` if given."""
    return not lineage(owner).others.isdisjoint(bases or ENUMS)


def member_values(owner: OwnClass) -> dict[str, ast.expr] | None:
    """Return the values of the members of an enumeration, by name; None if they are computed."""
    if len(lineage(owner).classes) != 1 or defines(owner, "__new__"):
        return None
    found: dict[str, ast.expr] = {}
    for statement in owner.definition.node.body:
        match statement:
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Constant() as value):
                found[name] = value
            case ast.Expr() | ast.Pass() | ast.FunctionDef():
                pass
            case _:
                return None
    return found


def is_named_tuple(owner: OwnClass) -> bool:
    """Return whether a class is a NamedTuple."""
    family = lineage(owner)
    return family.others == {NAMED_TUPLE} and len(family.classes) == 1


def is_record(owner: OwnClass) -> bool:
    """Return whether a class is a TypedDict."""
    others = lineage(owner).others
    return bool(others) and others <= RECORDS


def is_plain(owner: OwnClass) -> bool:
    """Return whether objects of a class are nothing else than that: no numbers, texts or tuples."""
    others = lineage(owner).others
    return others <= PLAIN_BASES | {"enum.Enum"} and known_attributes(owner) is not None


def _own(definition: Class) -> Iterator[str]:
    for statement in definition.node.body:
        yield from defined_names(statement, declared=True)
    for method in definition.methods:
        yield method.name
        if method.node is not None:
            yield from created_attributes(method.node)


@lru_cache(maxsize=128)
def updated_targets(module: Module) -> frozenset[int]:
    """Return the ``id`` of each target of '+=' and the like in a file, which is read first."""
    nodes = walk(module.tree.body)
    return frozenset(id(node.target) for node in nodes if isinstance(node, ast.AugAssign))


@lru_cache(maxsize=128)
def assigned_from_outside(module: Module) -> frozenset[str]:
    """Return the names that the file assigns as attributes of anything but ``self``."""
    updated = updated_targets(module)
    return frozenset(
        node.attr
        for node in walk(module.tree.body)
        if isinstance(node, ast.Attribute)
        and isinstance(node.ctx, ast.Store)
        and id(node) not in updated
        and not (isinstance(node.value, ast.Name) and node.value.id == "self")
    )
