"""Python files of behaviors and classes, parsed instead of imported.

Validation must not run user code, and must work without ROS. So classes, methods and arguments are
read from the syntax tree. What syntax does not determine (a base class in another package, a class
decorator, ``__getattr__``) is marked as unknown, and rules do not report it as missing.
"""

from composer.python_code.source.lookup import (
    BehaviorSource,
    BrokenModule,
    find_behavior,
    imported_from,
)
from composer.python_code.source.nearby_modules import NearbyModules, nearby_modules
from composer.python_code.source.scopes import Call, Scope, published_port
from composer.python_code.source.syntax import Class, Method, Module, scopes_in
from composer.python_code.source.trees import Function

__all__ = [
    "BehaviorSource",
    "BrokenModule",
    "Call",
    "Class",
    "Function",
    "Method",
    "Module",
    "NearbyModules",
    "Scope",
    "find_behavior",
    "imported_from",
    "nearby_modules",
    "published_port",
    "scopes_in",
]
