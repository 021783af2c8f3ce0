"""The ``--qos-*`` options of topic commands, as ros2 has them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from composer.qos import QosProfile


class Reliability(StrEnum):
    """Whether a lost message is sent again."""

    RELIABLE = "reliable"
    BEST_EFFORT = "best_effort"


class Durability(StrEnum):
    """Whether a late joiner gets what was published before."""

    VOLATILE = "volatile"
    TRANSIENT_LOCAL = "transient_local"


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
        return chosen_profile(start, self.preset, self.reliability, self.durability, self.depth)


def chosen_profile(
    start: QosProfile,
    preset: Preset | None,
    reliability: Reliability | None,
    durability: Durability | None,
    depth: int | None,
) -> QosProfile:
    """Return ``start``, or the preset, with the policies that are given."""
    from composer import qos

    profile = start if preset is None else qos.PRESETS[preset.value]
    if reliability is not None:
        profile = replace(profile, reliability=qos.Reliability(reliability.value))
    if durability is not None:
        profile = replace(profile, durability=qos.Durability(durability.value))
    return profile if depth is None else replace(profile, depth=depth)
