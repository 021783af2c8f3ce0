"""Whether a node of another process is in the ROS graph, with the ports that it declares."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from rclpy.node import Node as RosNode
from rclpy.topic_endpoint_info import TopicEndpointInfo

from composer.model import Node, Port, PortKind
from composer.model.names import join_node_name, split_node_name
from composer.runtime.middleware.dds_participants import is_in_group
from composer.runtime.ros_graph.graph import RosGraph, clients_of, participant, servers_of

#: Topics that nearly every node publishes.
_PARAMETER_EVENTS = "/parameter_events"  # each node has a publisher of its own
_COMMON_TOPICS = ("/rosout", _PARAMETER_EVENTS)
#: The service that every action server has.
_SEND_GOAL = "/_action/send_goal"


class NodePresence:
    """The endpoints of one node, as the manager node has discovered them.

    DDS shows a killed process for 20 s more. An endpoint has the prefix of its participant, so the
    endpoints of an earlier process can be ignored: those of :meth:`participants` at its start.
    """

    def __init__(self, manager: RosNode, model: Node) -> None:
        self._manager = manager
        self._model = model
        names = map(split_node_name, (model.full_name, *model.inner_nodes))
        self._names = {(name, namespace) for namespace, name in names}
        program = model.executable
        #: False: any node may be one of its program.
        self._are_known = not (model.keeps_names and program is not None and not program.nodes)

    def participants(self) -> frozenset[bytes]:
        """Return the prefixes of the participants with this node, as far as they are known."""
        found = self._common_endpoints()
        for port in self._model.ports:
            found += self._endpoints(port)
        return frozenset(map(participant, self._own(found)))

    def has_node(self, earlier: frozenset[bytes] = frozenset()) -> bool:
        """Return whether the node is in the graph, and not only as part of ``earlier``."""
        if not self._are_known or self.participants() - earlier:
            return True
        return not earlier and not self._names.isdisjoint(RosGraph(self._manager).nodes())

    def namesakes(self, earlier: frozenset[bytes]) -> int:
        """Return how many nodes its process has created with its name, in any namespace."""
        events = self._manager.get_publishers_info_by_topic(_PARAMETER_EVENTS)
        name = self._model.ros_name.value
        counts = Counter(participant(event) for event in events if event.node_name == name)
        return max((counts[item] for item in self.participants() - earlier), default=0)

    def names_in(self, pid: int) -> set[str]:
        """Return the full names of the nodes in a process and its children."""
        return {
            join_node_name(endpoint.node_namespace, endpoint.node_name)
            for endpoint in self._common_endpoints()
            if is_in_group(participant(endpoint), pid)
        }

    def names_elsewhere(self) -> set[str]:
        """Return the full names of nodes with its name in other namespaces."""
        nodes = set(RosGraph(self._manager).nodes()) - self._names
        name = self._model.ros_name.value
        return {join_node_name(namespace, last) for last, namespace in nodes if last == name}

    def missing(self, earlier: frozenset[bytes] = frozenset()) -> tuple[Port, ...]:
        """Return the declared ports that the node does not have yet."""
        return tuple(
            port
            for port in self._model.ports
            if all(
                participant(endpoint) in earlier for endpoint in self._own(self._endpoints(port))
            )
        )

    def has_service(self, service: str, earlier: frozenset[bytes]) -> bool:
        """Return whether the node provides a service, by its full name."""
        servers = self._own(servers_of(self._manager, service))
        return any(participant(endpoint) not in earlier for endpoint in servers)

    def _common_endpoints(self) -> list[TopicEndpointInfo]:
        return [
            endpoint
            for topic in _COMMON_TOPICS
            for endpoint in self._manager.get_publishers_info_by_topic(topic)
        ]

    def _own(self, endpoints: Iterable[TopicEndpointInfo]) -> Iterator[TopicEndpointInfo]:
        for endpoint in endpoints:
            name = (endpoint.node_name, endpoint.node_namespace)
            if not self._are_known or name in self._names:
                yield endpoint

    def _endpoints(self, port: Port) -> list[TopicEndpointInfo]:
        """Return the endpoints of all nodes that are like the port."""
        name = port.full_name
        match port.kind:
            case PortKind.PUBLISHER:
                return list(self._manager.get_publishers_info_by_topic(name))
            case PortKind.SUBSCRIPTION:
                return list(self._manager.get_subscriptions_info_by_topic(name))
            case PortKind.SERVICE:
                return servers_of(self._manager, name)
            case PortKind.CLIENT:
                return clients_of(self._manager, name)
            case PortKind.ACTION_SERVER:
                return servers_of(self._manager, name + _SEND_GOAL)
            case PortKind.ACTION_CLIENT:
                return clients_of(self._manager, name + _SEND_GOAL)
