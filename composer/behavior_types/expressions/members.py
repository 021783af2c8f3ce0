"""The types of the attributes of values."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.behavior_source import helper_named
from composer.behavior_types.expressions.objects import attribute_of_class, attribute_of_object
from composer.behavior_types.libraries.api_values import api_member, class_member
from composer.behavior_types.libraries.iterables import element_of
from composer.behavior_types.libraries.numpy_types import ARRAY, array_attribute
from composer.behavior_types.scalars import is_text
from composer.behavior_types.values import (
    ApiValue,
    BuiltinMethod,
    BuiltinObject,
    Collection,
    CollectionMethod,
    InterfaceClass,
    OwnClass,
    OwnModule,
    OwnObject,
    Parameters,
    Ports,
    Self,
    Value,
)
from composer.field_types import ANYTHING, STRING, fields_of, parameter_type
from composer.interfaces import FieldType, Message
from composer.model import PortKind

if TYPE_CHECKING:
    from composer.behavior_types.expressions.function_types import FunctionTypes

_PORT_CLASSES = {
    PortKind.PUBLISHER: "Publisher",
    PortKind.CLIENT: "Client",
    PortKind.ACTION_CLIENT: "ActionClient",
}


def attribute_of(scope: FunctionTypes, owner: Value, name: str) -> Value:
    """Return the type of attribute ``name`` of a value."""
    match owner:
        case Self():
            return scope.owner.attribute(name)
        case Ports(kind=kind):
            port = scope.owner.node.port(name)
            found = port is not None and port.kind is kind
            return ApiValue(_PORT_CLASSES[kind], port) if found else ANYTHING
        case Parameters():
            parameter = scope.owner.node.parameter(name)
            if parameter is None:
                return ANYTHING
            choices = parameter.choices.value if parameter.choices is not None else ()
            value = parameter_type(parameter.type.value, choices)
            is_array = isinstance(value, FieldType) and value.is_array
            return Collection(list, element_of(value)) if is_array else value
        case ApiValue():
            return api_member(owner, name, scope.owner.interfaces)
        case InterfaceClass(definition=definition):
            return class_member(definition, name)
        case Collection():
            return CollectionMethod(owner, name)
        case BuiltinObject(python=python):
            of_array = array_attribute(name) if owner == ARRAY else None
            return BuiltinMethod(python, name) if of_array is None else of_array
        case OwnObject():
            return attribute_of_object(scope, owner, name)
        case OwnClass():
            return attribute_of_class(scope, owner, name)
        case OwnModule(module=module):
            helper = helper_named(name, module)
            return ANYTHING if helper is None else scope.of_helper(helper.module, helper.name)
        case FieldType() if is_text(owner):
            return CollectionMethod(Collection(str, STRING), name)
        case Message() | FieldType():
            message = fields_of(owner, scope.owner.interfaces)
            member = message.field(name) if message is not None else None
            if member is None:
                return class_member(message, name) if message is not None else ANYTHING
            return scope.normal(member.type)
        case _:
            return ANYTHING
