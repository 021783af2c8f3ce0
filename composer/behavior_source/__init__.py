"""Python behaviours read as syntax: what a class has is known without importing anything.

Validating must not run user code, and must work where ROS is not installed. So classes, methods
and their arguments are read from the text; what syntax cannot tell (a base class out of reach, a
class decorator, ``__getattr__``) is said to be unknown, and nobody may then claim that something
is missing.
"""

from composer.behavior_source.bodies import Call
from composer.behavior_source.finding import BehaviorSource, find_behavior
from composer.behavior_source.publishing import published_port
from composer.behavior_source.syntax import Method

__all__ = ["BehaviorSource", "Call", "Method", "find_behavior", "published_port"]
