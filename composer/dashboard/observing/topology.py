"""The nodes of the ROS graph with their endpoints, and what the views ask about them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from functools import cached_property

from composer.base.fast_dataclass import dataclass
from composer.model import PortKind
from composer.model.names import is_hidden
from composer.plan.drift import ObservedEndpoint, ObservedNode, Snapshot, is_manager

_GET_STATE = "lifecycle_msgs/srv/GetState"


@dataclass(frozen=True)
class Topology:
    """The nodes of the ROS graph with all of their endpoints. ``revision`` counts changes.

    ``counts`` has the number of nodes of each name. Nodes of commands are left out.
    """

    revision: int
    nodes: Mapping[str, tuple[ObservedEndpoint, ...]]
    counts: Mapping[str, int]

    @cached_property
    def visible(self) -> list[str]:
        """The names of nodes that are not hidden, sorted."""
        return [name for name in self.nodes if not is_hidden(name)]

    @cached_property
    def lifecycle_nodes(self) -> frozenset[str]:
        """The nodes that report their lifecycle state on request."""
        return frozenset(
            node
            for node, ends in self.nodes.items()
            if any((end.name, end.type) == (f"{node}/get_state", _GET_STATE) for end in ends)
        )

    def snapshot(self, states: Mapping[str, str | None]) -> Snapshot:
        """Return the nodes as :mod:`composer.graph` and :mod:`composer.plan.drift` read them."""
        return Snapshot(
            tuple(
                ObservedNode(
                    full_name=name,
                    endpoints=tuple(end for end in ends if not end.is_for_tools),
                    state=states.get(name, ""),
                    count=self.counts.get(name, 1),
                )
                for name, ends in self.nodes.items()
            )
        )

    @cached_property
    def of_topics(self) -> Mapping[str, list[tuple[str, ObservedEndpoint]]]:
        """The endpoints of each topic with the names of their nodes."""
        found: dict[str, list[tuple[str, ObservedEndpoint]]] = {}
        for name in self.visible:
            for end in self.nodes[name]:
                if end.kind in (PortKind.PUBLISHER, PortKind.SUBSCRIPTION):
                    found.setdefault(end.name, []).append((name, end))
        return found

    @cached_property
    def managers(self) -> frozenset[str]:
        """The managers of running systems: the page shows their reports and has their commands."""
        return frozenset(node for node, ends in self.nodes.items() if is_manager(node, ends))

    def is_for_tools(self, name: str) -> bool:
        """Return whether a topic or service is hidden by name, or is one of a manager."""
        return is_hidden(name) or name.rpartition("/")[0] in self.managers


def first_topology() -> Topology | None:
    """Return what systems on this computer know of the ROS graph, None if none is certain.

    Ask before joining it: systems are not certain while they discover another process.
    """
    from composer.client.systems.local_queries import local_endpoints
    from composer.runtime.ros.graph import COMMAND_PREFIX

    answer = local_endpoints()
    if answer is None:
        return None
    found, names = answer
    counts = Counter(
        name for name in names if not name.rpartition("/")[2].startswith(COMMAND_PREFIX)
    )
    return Topology(1, {name: found[name] for name in sorted(found) if name in counts}, counts)
