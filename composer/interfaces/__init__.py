"""Message, service and action definitions, without rclpy.

``Interfaces.load(folders)`` knows, in this order: the interface packages among a project's sources,
the installed ones (``AMENT_PREFIX_PATH``, then the prefix of this Python), and a snapshot of
Jazzy's own (``jazzy.json``, made by ``tools/bundle_interfaces.py``).
"""

from composer.interfaces.definitions import (
    FLOATS,
    INTEGER_RANGES,
    PRIMITIVES,
    TEXTS,
    Action,
    Field,
    FieldType,
    Interface,
    Message,
    MessageConstant,
    Service,
    parts,
)
from composer.interfaces.index import Interfaces, InvalidDefinition
from composer.interfaces.parser import DefinitionError, parse_definition, split_name
