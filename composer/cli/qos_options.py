"""The ``--qos-*`` options of topic commands, as ros2 has them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated

import typer

from composer.qos import PRESETS, Durability, QosProfile, Reliability


class Preset(StrEnum):
    """The presets of the language."""

    SENSOR_DATA = "sensor_data"
    COMMAND = "command"
    STATE = "state"
    SERVICES_DEFAULT = "services_default"
    PARAMETERS = "parameters"
    SYSTEM_DEFAULT = "system_default"


QosPreset = Annotated[
    Preset | None, typer.Option("--qos-profile", help="A preset.", show_default=False)
]
QosReliability = Annotated[
    Reliability | None, typer.Option("--qos-reliability", show_default=False)
]
QosDurability = Annotated[Durability | None, typer.Option("--qos-durability", show_default=False)]
QosDepth = Annotated[
    int | None,
    typer.Option("--qos-depth", min=1, metavar="N", help="Messages kept.", show_default=False),
]


@dataclass(frozen=True, slots=True)
class QosWish:
    """What the options say of a profile; None where they say nothing."""

    preset: Preset | None
    reliability: Reliability | None
    durability: Durability | None
    depth: int | None

    def applied_to(self, start: QosProfile) -> QosProfile:
        """Return ``start``, or the preset, with the policies that are given."""
        profile = start if self.preset is None else PRESETS[self.preset.value]
        if self.reliability is not None:
            profile = replace(profile, reliability=self.reliability)
        if self.durability is not None:
            profile = replace(profile, durability=self.durability)
        return profile if self.depth is None else replace(profile, depth=self.depth)
