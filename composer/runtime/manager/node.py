"""The manager node of a system: its commands as services, and its status as topics.

The services (std_srvs/srv/Trigger) are named as those of nav2's lifecycle manager: ``startup``,
``pause``, ``resume``, ``reset``, ``shutdown`` and ``is_active``. ``startup_all_or_nothing`` and
``resume_all_or_nothing`` undo everything if a node fails. The service ``request`` has the requests
of commands and other processes: see :mod:`composer.runtime.protocol`.

Its topics are described in :mod:`.publishing`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time_source import USE_SIM_TIME_NAME
from std_srvs.srv import Trigger

from composer.runtime.callbacks.log import Log
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import EventCounts, Reply, unused_callback
from composer.runtime.executors.tracebacks import exception_log
from composer.runtime.manager.graph_view import GraphObserver, ManagerQueries
from composer.runtime.manager.member_service import MemberService, answer_calls
from composer.runtime.manager.other_instances import OtherInstances
from composer.runtime.manager.publishing import ManagerContext, ReportPublisher
from composer.runtime.node.local_node import LocalNode
from composer.runtime.node.options import ProcessContext
from composer.runtime.node.parameter_services import ParameterServices, provide_logger_services
from composer.runtime.node_time import NodeTime, SimTimeSource, publish_clock
from composer.runtime.process.query_socket import QuerySocket
from composer.runtime.protocol.codec import ProtocolError
from composer.runtime.protocol.requests import (
    ALL_OR_NOTHING,
    IS_ACTIVE,
    NAME,
    REQUEST,
    AskReportKey,
    CallNodes,
    ChangeStates,
    Done,
    Instance,
    Restart,
    SaveRecording,
)
from composer.runtime.ros.graph import GraphChanges
from composer.runtime.ros.service_requests import (
    RequestService,
    answer_message,
    limit_type_descriptions,
    limited,
    read_request,
)
from composer.runtime.supervision.main_queue import Command
from composer.runtime.transforms.listener import TransformListeners

COMMANDS = (
    *("startup", "pause", "resume", "reset", "shutdown"),
    *(f"{name}{ALL_OR_NOTHING}" for name in ("startup", "resume")),
)
_RESTART = "restart"
#: The requests of the coordinating process to the others.
_OF_MEMBERS = (ChangeStates, AskReportKey)
_OF_COMMANDS = (Restart, SaveRecording, CallNodes)
_PERIOD_S = 1.0
_ENDS_WITHIN_S = 0.2
_RESPONSES_ARRIVE_WITHIN_S = 0.15


class ManagerNode:
    """The manager node, on a loop of its own, which no other node can block.

    Its subscription to /clock serves all nodes, so that none of them can delay the time.
    """

    def __init__(
        self, namespace: str, context: ManagerContext, *, use_sim_time: bool = False
    ) -> None:
        """Join the ROS graph. With ``use_sim_time``, stamps have the time of /clock."""
        status = context.status
        self._context = context
        self._loop = Loop(NAME, exception_log(status.clock, context.write_log), clock=status.clock)
        self._member: MemberService | None = None
        self._node = Node(
            NAME,
            namespace=namespace,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,  # see parameter_services.py
        )
        limit_type_descriptions(self._node)
        self._log = Log(self._node, context.write_log)
        self._own_parameters = ParameterServices(self._node, status.clock, self._log.warn)
        self._own_parameters.provide()
        provide_logger_services(self._node, status.clock, self._log.warn)
        self._loop.add_node(self._node)
        simulated_time = SimTimeSource(self._node, self._loop, self._log.warn)
        self.process_context = ProcessContext(
            self._node,
            simulated_time,
            EventCounts(self._loop),
            TransformListeners(self._node, self._loop, simulated_time, self._log.warn),
        )
        self._clock = NodeTime(self._node, self._loop, simulated_time)
        self._node.set_parameters([Parameter(USE_SIM_TIME_NAME, value=use_sim_time)])
        for command in COMMANDS:
            self._add_service(Trigger, command, partial(self._on_command, command))
        self._add_service(Trigger, IS_ACTIVE, self._on_is_active)
        self._add_service(limited(RequestService), REQUEST, self._on_request)
        changes = GraphChanges(self._node)
        self._instances = OtherInstances(
            changes,
            self._loop,
            self._instance,
            on_older=context.on_older_instance,
            on_permanent=self._warn_of_instance,
        )
        own_participant = self._instances.participant
        self._reports = ReportPublisher(
            self.process_context, self._loop, context, own_participant.hex()
        )
        if context.report_key:
            self._member = MemberService(self._loop, context, self._reports, self._log.info)
        self._graph = GraphObserver(changes, own_participant)
        queries = ManagerQueries(self._loop, self._graph, self._parameter_services, self._reports)
        self._query_socket: QuerySocket | None = None
        if not status.clock.is_isolated:
            if status.clock.is_virtual:
                publish_clock(self._node, self._loop)
            self._query_socket = QuerySocket(namespace, queries.answers(), self._on_query_error)
        self._loop.start()
        self._loop.call_every(_PERIOD_S, self._tick)
        self._loop.call_soon(self._reports.publish)
        status.on_change(self._reports.publish_soon)

    def retire(self, *, linger: bool) -> None:
        """Publish the last status and stop the loop; ``linger`` until responses have arrived.

        In shared memory, a response would disappear together with the node.
        """
        if self._query_socket is not None:
            self._query_socket.close(_ENDS_WITHIN_S)
        self._context.status.on_change(lambda: None)
        self._loop.call_soon(self._reports.publish)
        if linger:
            self._loop.clock.sleep(_RESPONSES_ARRIVE_WITHIN_S)
        self._loop.stop(_ENDS_WITHIN_S)

    def destroy(self) -> None:
        """Leave the ROS graph."""
        self._node.destroy_node()

    def _parameter_services(self) -> dict[str, tuple[Loop, ParameterServices]]:
        """Return the loops and parameters of the manager and the nodes of this process."""
        own = (self._loop, self._own_parameters)
        return {self._node.get_fully_qualified_name(): own} | {
            name: (node.loop, node.parameter_services)
            for name, node in self._context.nodes().items()
            if isinstance(node, LocalNode)
        }

    def _add_service(self, kind: Any, name: str, callback: Callable[[Any, Reply], None]) -> None:
        service = self._node.create_service(kind, f"~/{name}", unused_callback)
        self._loop.add_service(service, callback)

    def _on_command(self, name: str, _: Trigger.Request, reply: Reply) -> None:
        def answer(success: bool, message: str) -> None:
            self._loop.call_soon(lambda: reply(Trigger.Response(success=success, message=message)))

        command, all_or_nothing, _ = name.partition(ALL_OR_NOTHING)
        self._context.on_command(Command(command, answer, all_or_nothing=bool(all_or_nothing)))

    def _on_request(self, message: Any, reply: Reply) -> None:
        """Answer a request, or send it to what answers it."""
        kinds = _OF_COMMANDS if self._member is None else (*_OF_MEMBERS, *_OF_COMMANDS)
        try:
            request = read_request(message, *kinds)
        except ProtocolError as error:
            reply(answer_message(error))
            return
        if isinstance(request, Restart):
            self._restart(request.nodes, reply)
        elif isinstance(request, SaveRecording):
            self._context.save_recording(partial(self._answer, reply))
        elif isinstance(request, CallNodes):
            self._loop.run_task(self._call_nodes(request, reply))
        elif self._member is not None:
            self._member.on_request(request, lambda answer: reply(answer_message(answer)))

    async def _call_nodes(self, request: CallNodes, reply: Reply) -> None:
        reply(answer_message(await answer_calls(request, self._context.nodes())))

    def _answer(self, reply: Reply, success: bool, message: str) -> None:
        """Answer a request, from any thread."""
        self._loop.call_soon(lambda: reply(answer_message(Done(success, message))))

    def _restart(self, nodes: tuple[str, ...], reply: Reply) -> None:
        answer = partial(self._answer, reply)
        known = self._context.nodes()
        unknown = [name for name in nodes if name not in known]
        if unknown or not nodes:
            expected = "expected the full names of nodes"
            answer(False, f"there is no node '{unknown[0]:.256}'" if unknown else expected)
        else:
            self._context.on_command(Command(_RESTART, answer, nodes))

    def _on_is_active(self, _: Trigger.Request, reply: Reply) -> None:
        status = self._context.status.snapshot()
        reply(Trigger.Response(success=status.is_active, message=status.message))

    def _tick(self) -> None:
        self._context.update_status()
        self._instances.check()
        self._graph.note_participants()
        self._reports.tick()

    def _on_query_error(self, error: Exception) -> None:
        self._node.get_logger().error(f"cannot answer a query of a command: {error!r}")

    def _instance(self) -> Instance:
        status = self._context.status.without_nodes
        return Instance(status.host, status.pid, self._reports.uptime_s)

    def _warn_of_instance(self, other: Instance) -> None:
        self._log.warn(
            f"this system also runs on host {other.host}, process {other.pid}: their nodes have the"
            " same names and topics; stop one of them"
        )
