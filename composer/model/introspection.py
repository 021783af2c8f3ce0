"""Which introspection endpoints a node offers to ROS tools."""

from __future__ import annotations

from composer.fast_dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Introspection:
    """The endpoints of a node for ROS tools; disabled ones are never created.

    ``parameters``: the parameter services (rcl_interfaces); ``rosout``: the publisher of its log on
    /rosout; ``type_description``: the service of that name; ``lifecycle_services``: those of
    lifecycle_msgs. The manager node serves parameters and lifecycle for nodes without these
    services.
    """

    parameters: bool = True
    rosout: bool = True
    type_description: bool = True
    lifecycle_services: bool = True

    @property
    def endpoints(self) -> int:
        """The number of publishers, and of both ends of services."""
        numbers = (
            13 * self.parameters,
            self.rosout,
            2 * self.type_description,
            10 * self.lifecycle_services,
        )
        return 1 + sum(numbers)  # transition_event is always there

    @property
    def left_to_manager(self) -> tuple[str, ...]:
        """The services that the manager node provides for the node: "lifecycle", "parameters"."""
        lifecycle = () if self.lifecycle_services else ("lifecycle",)
        return lifecycle if self.parameters else (*lifecycle, "parameters")


DEFAULT_INTROSPECTION = Introspection()
#: A node outside the process: the manager starts and ends it, all else it has itself.
DRIVEN_BY_MANAGER = Introspection(lifecycle_services=False)
