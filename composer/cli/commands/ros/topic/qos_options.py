"""The ``--qos-*`` options of topic commands, named as in ros2."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from typing import Annotated, Any

import typer

from composer.base.fast_dataclass import dataclass
from composer.cli.commands.ros.topic.option_groups import option_group
from composer.cli.support.options import finite
from composer.model.qos import PRESETS, Durability, History, Liveliness, QosProfile, Reliability


class Preset(StrEnum):
    """The QoS presets of the language."""

    SENSOR_DATA = "sensor_data"
    COMMAND = "command"
    STATE = "state"
    SERVICES_DEFAULT = "services_default"
    PARAMETERS = "parameters"
    SYSTEM_DEFAULT = "system_default"


@dataclass(frozen=True, slots=True)
class QosOptions:
    """The QoS policies given as options, None where not given.

    Each field is the option ``--qos-<field>``.
    """

    profile: Annotated[Preset | None, typer.Option(help="QoS preset.")] = None
    history: Annotated[History | None, typer.Option(help="QoS history.")] = None
    depth: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Queue size with keep_last.")
    ] = None
    reliability: Annotated[Reliability | None, typer.Option(help="QoS reliability.")] = None
    durability: Annotated[Durability | None, typer.Option(help="QoS durability.")] = None
    liveliness: Annotated[Liveliness | None, typer.Option(help="QoS liveliness.")] = None
    liveliness_lease_duration_seconds: Annotated[
        float | None,
        typer.Option(
            min=0.0, callback=finite, metavar="SECONDS", help="QoS liveliness lease duration."
        ),
    ] = None

    def applied_to(self, start: QosProfile) -> QosProfile:
        """Return ``start``, or the preset, with the given policies."""
        lease_s = self.liveliness_lease_duration_seconds
        policies = {
            "history": self.history,
            "depth": self.depth,
            "reliability": self.reliability,
            "durability": self.durability,
            "liveliness": self.liveliness,
            "liveliness_lease_duration_ms": None if lease_s is None else lease_s * 1000.0,
        }
        given: dict[str, Any] = {
            name: value for name, value in policies.items() if value is not None
        }
        return replace(start if self.profile is None else PRESETS[self.profile.value], **given)


#: For commands with a parameter ``qos``, which is a QosOptions.
qos_options = option_group("qos", QosOptions, prefix="qos_")
