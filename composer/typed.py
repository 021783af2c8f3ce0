"""Base classes of behaviors that know their node type, for editors and type checkers.

``compose stubs`` writes ``typings/composer/typed.pyi`` with a class for each node type: its
publishers, clients, parameters and handlers. While code runs, each is plain
:class:`composer.behavior.Behavior`, so neither ROS nor the stubs are needed::

    from composer.typed import PlannerBehavior

    class Planner(PlannerBehavior): ...
"""

from __future__ import annotations

from composer.behavior import Behavior

SUFFIX = "Behavior"


def __getattr__(name: str) -> type[Behavior]:
    if name.endswith(SUFFIX) and name != SUFFIX and name.isidentifier():
        return Behavior
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
