"""Checks attributes: of messages, of the API, and of the behavior itself."""

from __future__ import annotations

import ast
from array import array
from collections.abc import Iterable
from functools import lru_cache
from inspect import isabstract
from types import FunctionType

from composer.behavior_checks.problems import Kind
from composer.behavior_source import Function, Module
from composer.behavior_types.api import members
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.libraries.rclpy_api import is_rclpy
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.syntax.lineage import lineage
from composer.behavior_types.syntax.module_names import module_names
from composer.behavior_types.syntax.own_classes import (
    assigned_from_outside,
    is_enumeration,
    is_frozen,
    is_record,
    known_attributes,
)
from composer.behavior_types.syntax.self_attributes import escapes_from, sets_computed_names
from composer.behavior_types.values import (
    ApiValue,
    BuiltinObject,
    Collection,
    InterfaceClass,
    ModuleFunction,
    OwnClass,
    OwnMethod,
    OwnModule,
    OwnObject,
    Parameters,
    Ports,
    Self,
    Value,
)
from composer.diagnostics import nearest, suggestion
from composer.field_types import described
from composer.interfaces import (
    FLOATS,
    INTEGER_RANGES,
    Action,
    FieldType,
    Interfaces,
    Message,
    Service,
)
from composer.model import Node

_MESSAGE_ATTRIBUTES = frozenset({"SLOT_TYPES", "get_fields_and_field_types"})
_PYTHON_TYPES: dict[str, type] = {
    "string": str,
    "wstring": str,
    "bool": bool,
    **dict.fromkeys(FLOATS, float),
    **dict.fromkeys(INTEGER_RANGES.keys() - {"byte"}, int),
}

#: The attributes of arrays of Python and of numpy, which messages use for numbers.
_OF_ARRAYS = frozenset(
    {
        *dir(array),
        *("T", "all", "any", "argmax", "argmin", "argpartition", "argsort", "astype", "base"),
        *("byteswap", "choose", "clip", "compress", "conj", "conjugate", "copy", "ctypes"),
        *("cumprod", "cumsum", "data", "device", "diagonal", "dot", "dtype", "dump", "dumps"),
        *("fill", "flags", "flat", "flatten", "getfield", "imag", "item", "itemset", "mT"),
        *("max", "mean", "min", "nbytes", "ndim", "newbyteorder", "nonzero", "partition"),
        *("prod", "ptp", "put", "ravel", "real", "repeat", "reshape", "resize", "round"),
        *("searchsorted", "setfield", "setflags", "shape", "size", "sort", "squeeze", "std"),
        *("strides", "sum", "swapaxes", "take", "to_device", "tobytes", "trace", "transpose"),
        *("var", "view"),
    }
)

#: The attributes of classes that are derived from dict.
_OF_DICTS = frozenset({"default_factory", "elements", "most_common", "move_to_end", "subtract"})

#: The problem of an attribute: its kind, message and hint.
Found = tuple[Kind, str, str | None]


@lru_cache(maxsize=512)
def names_looked_for(function: Function) -> frozenset[str]:
    """Return the attributes that a function asks for by ``hasattr``."""
    found: set[str] = set()
    for node in nodes_of(function):
        match node:
            case ast.Call(func=ast.Name(id="hasattr"), args=[_, ast.Constant(value=str() as name)]):
                found.add(name)
    return frozenset(found)


def attribute_problem(types: BehaviorTypes, owner: Value, name: str) -> Found | None:
    """Return the problem of attribute ``name`` of a value, or None."""
    if name.startswith("_") and not isinstance(owner, Self):
        return None
    match owner:
        case Ports(kind=kind):
            known = [port.name.value for port in types.node.ports_of(kind)]
            return _missing_port(types.node, kind.value, kind.section, name, known)
        case Parameters():
            known = [item.name.value for item in types.node.parameters]
            return _missing_port(types.node, "parameter", "parameters", name, known)
        case ApiValue(class_name=class_name):
            return _missing_member(class_name, name)
        case Self():
            return _missing_attribute(types, name)
        case InterfaceClass(definition=definition):
            return _missing_part(definition, name)
        case Message():
            return _missing_field(owner, name)
        case FieldType():
            return _of_field(owner, name, types.interfaces)
        case BuiltinObject(python=python) if not hasattr(python, name):
            hint = "write str(...)" if name == "message" else suggestion(name, dir(python))
            return Kind.ATTRIBUTE, f"{python.__name__} has no attribute '{name}'", hint
        case Collection(python=python) if not isabstract(python) and not hasattr(python, name):
            if python is dict and name in _OF_DICTS:
                return None
            close = nearest(name, dir(python))
            hint = f"did you mean '{close}'?" if close is not None else None
            return Kind.ATTRIBUTE, f"a {python.__name__} has no attribute '{name}'", hint
        case OwnClass() | OwnObject():
            return _of_own_class(types, owner, name)
        case OwnModule(module=module):
            return _of_own_module(types, module, name)
        case OwnMethod() | ModuleFunction():
            return _of_function(owner, name)
        case _:
            return None


def _missing_port(
    node: Node, kind: str, section: str, name: str, known: Iterable[str]
) -> Found | None:
    known = list(known)
    if name in known or not node.complete:
        return None
    if any(item.partition(".")[0] == name for item in known):
        return Kind.ATTRIBUTE, f"parameter names with dots need an index: ['{name}...']", None
    port = node.port(name)
    other = f"'{name}' is in '{port.kind.section}'" if port is not None else None
    hint = other or suggestion(name, known) or f"declare it in '{section}'"
    return Kind.ATTRIBUTE, f"the node has no {kind} '{name}'", hint


def _missing_member(class_name: str, name: str) -> Found | None:
    known = members(class_name)
    if name in known:
        return None
    return Kind.ATTRIBUTE, f"{class_name} has no attribute '{name}'", suggestion(name, known)


def _missing_attribute(types: BehaviorTypes, name: str) -> Found | None:
    if not types.source.complete or name in types.self_attributes:
        return None
    public = [other for other in types.self_attributes if not other.startswith("__")]
    close = nearest(name, public)
    if (close is None and types.self_escapes) or sets_computed_names(types.source):
        return None
    message = f"'{types.source.reference.class_name}' has no attribute '{name}'"
    hint = f"did you mean '{close}'?" if close else "no method of the class sets it"
    return Kind.ATTRIBUTE, message, hint


def _of_function(owner: OwnMethod | ModuleFunction, name: str) -> Found | None:
    """Return the problem of an attribute of a function; decorators and assignments add some."""
    function = owner.method.node if isinstance(owner, OwnMethod) else owner.node
    if function is None or function.decorator_list or hasattr(FunctionType, name):
        return None
    if isinstance(owner, ModuleFunction) and name in assigned_from_outside(owner.home):
        return None
    problem = f"the function '{function.name}' has no attribute '{name}'"
    return Kind.ATTRIBUTE, problem, f"call it: {function.name}()"


def _of_own_class(types: BehaviorTypes, owner: OwnClass | OwnObject, name: str) -> Found | None:
    own = owner.of if isinstance(owner, OwnObject) else owner
    known = known_attributes(own)
    if isinstance(owner, OwnObject) and is_record(own) and not hasattr(dict, name):
        problem = f"'{own.definition.name}' has no attribute '{name}': it is a dict"
        return Kind.ATTRIBUTE, problem, f"write ['{name}']"
    if known is None or name in known or (isinstance(owner, OwnClass) and hasattr(type, name)):
        return None
    if is_rclpy(own.home):
        if name.startswith("RMW_QOS_POLICY_"):  # an old name of a member
            return None
    elif _may_have(types, own, name, is_object=isinstance(owner, OwnObject)):
        return None
    is_similar = nearest(name, known) is not None or is_enumeration(own) or is_frozen(own)
    if isinstance(owner, OwnObject) and not is_similar and _is_passed_on(own):
        return None
    public = [other for other in known if not other.startswith("_")]
    problem = f"'{own.definition.name}' has no attribute '{name}'"
    return Kind.ATTRIBUTE, problem, suggestion(name, public)


def _may_have(types: BehaviorTypes, own: OwnClass, name: str, *, is_object: bool) -> bool:
    """Return whether a class, one derived from it, or an object of them may have an attribute."""
    classes = types.project_classes
    if is_object and not classes.is_created(own):
        return True
    derived = [known_attributes(item) for item in classes.derived(own)]
    if any(known is None or name in known for known in derived):
        return True
    return name in classes.assigned_outside and name in types.set_from_outside


def _is_passed_on(own: OwnClass) -> bool:
    """Return whether an object passes itself to other code, which may set attributes of it."""
    return any(
        method.node is not None and escapes_from(method.node, known.home, lambda _: False)
        for known in lineage(own).classes
        for method in known.definition.methods
    )


def _of_own_module(types: BehaviorTypes, module: Module, name: str) -> Found | None:
    known = module_names(module)
    if known is None or name in known or name in types.project_classes.assigned_outside:
        return None
    if name.startswith("__"):
        return None
    hint = suggestion(name, [other for other in known if not other.startswith("_")])
    return Kind.IMPORT, f"module '{module.path.stem}' has no '{name}'", hint


def _missing_part(definition: Message | Service | Action, name: str) -> Found | None:
    match definition:
        case Message():
            if definition.field(name) is not None:
                problem = f"{definition.name} is used without creating a message"
                return Kind.VALUE, problem, "add '()' to the class"
            names = [constant.name for constant in definition.constants]
            known = {
                *names,
                *_MESSAGE_ATTRIBUTES,
                *(f"{field.name.upper()}__DEFAULT" for field in definition.fields),
            }
        case Service():
            known, names = {"Request", "Response", "Event"}, ["Request", "Response"]
        case Action():
            known = {"Goal", "Result", "Feedback", "Impl"}
            names = ["Goal", "Result", "Feedback"]
    if name in known:
        return None
    kind = "constant" if isinstance(definition, Message) else "part"
    return Kind.FIELD, f"{definition.name} has no {kind} '{name}'", suggestion(name, names)


def _missing_field(message: Message, name: str) -> Found | None:
    constants = [constant.name for constant in message.constants]
    if name in message.field_names or name in constants or name in _MESSAGE_ATTRIBUTES:
        return None
    hint = suggestion(name, message.field_names)
    return Kind.FIELD, f"{message.name} has no field '{name}'", hint


def _of_field(type_: FieldType, name: str, interfaces: Interfaces) -> Found | None:
    if not type_.is_array:
        python = _PYTHON_TYPES.get(type_.name)
        if python is None or hasattr(python, name):
            return None
        close = nearest(name, dir(python))
        hint = f"did you mean '{close}'?" if close is not None else None
        return Kind.FIELD, f"{described(type_)} has no attribute '{name}'", hint
    element = interfaces.message(type_.name)
    if hasattr(list, name) or (element is None and name in _OF_ARRAYS):
        return None
    if element is None:
        return Kind.FIELD, f"{described(type_)} has no attribute '{name}'", "use an index"
    hint = "it is a list: use an index, or a loop" if element.field(name) else None
    return Kind.FIELD, f"{described(type_)} has no attribute '{name}'", hint
