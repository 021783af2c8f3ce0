"""The types of values in Python behaviors, and what contradicts them.

The types come from the node that uses the behavior, from the definitions of messages, and from the
API in :mod:`composer.behavior`. A value whose type depends on more than that has an unknown type,
which fits everywhere.
"""

from composer.behavior_types.checker import behavior_problems
from composer.behavior_types.imports import import_problems
from composer.behavior_types.problems import CodeProblem, Kind

__all__ = ["CodeProblem", "Kind", "behavior_problems", "import_problems"]
