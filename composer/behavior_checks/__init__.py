"""What contradicts the types of values in Python behaviors, and other mistakes in their code.

What has an unknown type fits everywhere.
"""

from composer.behavior_checks.checker import behavior_problems
from composer.behavior_checks.imports import import_problems
from composer.behavior_checks.problems import CodeProblem, Kind

__all__ = ["CodeProblem", "Kind", "behavior_problems", "import_problems"]
