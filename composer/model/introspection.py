"""What a node offers beside its own ports, for tools to look into it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Introspection:
    """Which endpoints a node has for tools; those given up are never created.

    ``parameters``: the parameter services (rcl_interfaces); ``rosout``: the publisher of its log on
    /rosout; ``type_description``: the service of that name; ``lifecycle_services``: those of
    lifecycle_msgs. The system's manager serves parameters and lifecycle of nodes without.
    """

    parameters: bool = True
    rosout: bool = True
    type_description: bool = True
    lifecycle_services: bool = True

    @property
    def left_to_manager(self) -> tuple[str, ...]:
        """What the manager of the system answers for the node: "lifecycle", "parameters"."""
        lifecycle = () if self.lifecycle_services else ("lifecycle",)
        return lifecycle if self.parameters else (*lifecycle, "parameters")


DEFAULT_INTROSPECTION = Introspection()
