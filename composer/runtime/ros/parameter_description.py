"""The description of a parameter, as commands print it. Imports nothing of ROS."""

from __future__ import annotations

from composer.base.fast_dataclass import dataclass


@dataclass(frozen=True, slots=True)
class ParameterDescription:
    """The description of a parameter. Bounds are None if there are none."""

    name: str
    type: str
    description: str
    constraints: str
    read_only: bool
    minimum: float | None
    maximum: float | None
    step: float | None
