"""Python behaviors, parsed instead of imported.

Validation must not run user code, and must work without ROS. So classes, methods and arguments are
read from the syntax tree. What syntax does not determine (a base class in another package, a class
decorator, ``__getattr__``) is marked as unknown, and rules do not report it as missing.
"""

from composer.behavior_source.helpers import Helper, helper_named, links_version
from composer.behavior_source.lookup import BehaviorSource, find_behavior, imported_from
from composer.behavior_source.method_body import Call, Function
from composer.behavior_source.modules import top_package
from composer.behavior_source.nearby_modules import NearbyModules, nearby_modules
from composer.behavior_source.publishing import published_port
from composer.behavior_source.syntax import Class, Method, Module

__all__ = [
    "BehaviorSource",
    "Call",
    "Class",
    "Function",
    "Helper",
    "Method",
    "Module",
    "NearbyModules",
    "find_behavior",
    "helper_named",
    "imported_from",
    "links_version",
    "nearby_modules",
    "published_port",
    "top_package",
]
