"""The levels of the loggers of nodes, through the standard logger services (rcl_interfaces).

A node that does not have these services is served by the manager of its process: a process keeps
the levels of all its loggers.
"""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import LoggerLevel
from rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels

from composer.client.graph_names import GraphNames
from composer.client.requests import ServiceCaller, required
from composer.client.session import Deadline, RosError, Session
from composer.client.systems.local_queries import nodes_with
from composer.client.systems.managers import DISCOVERY_S, Systems
from composer.model import SEVERITIES, LogLevel
from composer.runtime.callbacks.log import logger_name
from composer.runtime.protocol.requests import NAME

_GET, _SET = "get_logger_levels", "set_logger_levels"
_GET_TYPE = "rcl_interfaces/srv/GetLoggerLevels"
#: Of a logger whose level was never set: the level of its process applies.
UNSET = "unset"
_LEVELS = {severity: level.value for level, severity in SEVERITIES.items()}


class LevelRejectedError(RosError):
    """The node did not set the level."""


class LoggerLevels:
    """Reads and sets the levels of the loggers of nodes, all within one time limit."""

    def __init__(self, session: Session, deadline: Deadline) -> None:
        self._session = session
        self._deadline = deadline
        self._systems = Systems(session, deadline)
        self._caller = ServiceCaller(session)

    def all(self) -> dict[str, str | None]:
        """Return the levels of all nodes that can be asked, None for those that do not respond."""
        self._session.wait_until_settled(self._systems.discover, self._deadline)
        self._session.wait_for(
            lambda: None not in self._systems.current().values() or None, self._discovery
        )
        servers = self._servers()
        by_server: dict[str, list[str]] = {}
        for node, server in sorted(servers.items()):
            by_server.setdefault(server, []).append(node)
        levels: dict[str, str | None] = dict.fromkeys(sorted(servers))
        for server, nodes in by_server.items():
            (response,) = self._levels(server, nodes).values()
            if response is not None:
                levels.update(zip(nodes, map(_name_of, response.levels), strict=False))
        return levels

    def get(self, node: str) -> tuple[str, str]:
        """Return the full name of a node and its level.

        Raises NotFoundError; RosError if the level of the node cannot be read.
        """
        found, server = self._find(node)
        response = required(self._levels(server, [found]), self._deadline)
        return found, _name_of(response.levels[0])

    def set(self, node: str, level: LogLevel) -> str:
        """Set the level of a node, and return its full name. Raises like ``get``."""
        found, server = self._find(node)
        request = SetLoggerLevels.Request(
            levels=[LoggerLevel(name=logger_name(found), level=SEVERITIES[level])]
        )
        service = f"{server}/{_SET}"
        response = self._caller.call_once(SetLoggerLevels, service, request, self._deadline)
        (result,) = response.results
        if not result.successful:
            raise LevelRejectedError(f"{found} did not set its log level: {result.reason}")
        return found

    def _levels(self, server: str, nodes: list[str]) -> dict[str, Any]:
        """Return the response of a server by the name of its service, None without one."""
        request = GetLoggerLevels.Request(names=list(map(logger_name, nodes)))
        calls = {f"{server}/{_GET}": (GetLoggerLevels, request)}
        return self._caller.call_each(calls, self._deadline)

    def _find(self, node: str) -> tuple[str, str]:
        """Return the full name of a node, and the node with the services for it."""
        found = GraphNames(self._session, self._deadline).find_node(node)
        server = self._session.wait_for(lambda: self._servers().get(found), self._discovery)
        if server is None:
            raise RosError(
                f"{found} has no services for log levels",
                "start it with 'enable_logger_service' (rclpy, rclcpp)",
            )
        return found, server

    @property
    def _discovery(self) -> Deadline:
        return Deadline(min(DISCOVERY_S, self._deadline.left_s))

    def _servers(self) -> dict[str, str]:
        """Return the nodes with the services, by the nodes that they serve."""
        self._systems.discover()
        of_managers = {
            item.node: f"{name}/{NAME}"
            for name, report in self._systems.current().items()
            if report is not None
            for item in report.nodes
            if (item.pid, item.host or report.host) == (report.pid, report.host)
        }
        own = nodes_with(self._session.graph.services(), f"/{_GET}", _GET_TYPE)
        return of_managers | {node: node for node in own}


def _name_of(level: LoggerLevel) -> str:
    return _LEVELS.get(level.level, UNSET)
