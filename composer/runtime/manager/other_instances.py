"""Detects other processes that run the same system, on hosts that do not share the instance lock.

Each manager node has a hidden service with a unique name, which responds with its host, process
and uptime. Only such a response counts, never a message on a topic: any node can publish or replay
one. The system that started later is refused, within its first seconds; a system that has run for
longer reports the other one and continues.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any
from uuid import uuid4

from std_srvs.srv import Trigger

from composer.runtime.executors.futures import wrap_future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import Reply, unused_callback
from composer.runtime.executors.tasks import sleep, within
from composer.runtime.protocol.codec import ProtocolError, decode, encode
from composer.runtime.protocol.requests import INSTANCE_PREFIX, IS_ACTIVE, Instance
from composer.runtime.ros.graph import GraphChanges, participant, servers_of

#: Discovery of another participant takes up to three seconds; later, this system is not refused.
START_S = 5.0
_CHECK_PERIOD_S = 0.5
_RESPONSE_WITHIN_S = 2.0
#: The number of services that are called at the same time: other nodes cannot cause more.
_MAX_CALLS = 4
#: If two instances started within this time, the order of host names and process ids decides.
_SAME_START_S = 0.1
_HOST = re.compile(r"[\w.-]{1,253}", re.ASCII)


def is_older(instance: Instance, other: Instance) -> bool:
    """Return whether an instance started before another one.

    Not by the time of day, which may differ between hosts.
    """
    lead_s = instance.uptime_s - other.uptime_s
    if abs(lead_s) <= _SAME_START_S:
        return (instance.host, instance.pid) < (other.host, other.pid)
    return lead_s > 0.0


def parse_instance(text: str) -> Instance | None:
    """Return the instance that a response describes, None for anything else."""
    try:
        instance = decode(text, Instance)
    except ProtocolError:
        return None
    return instance if _HOST.fullmatch(instance.host) else None


class OtherInstances:
    """The service that identifies this instance, and calls to those of others."""

    def __init__(
        self,
        changes: GraphChanges,
        loop: Loop,
        own: Callable[[], Instance],
        *,
        on_older: Callable[[Instance], None],
        on_permanent: Callable[[Instance], None],
    ) -> None:
        """Add the service to the manager node, which ``loop`` serves, and start to check.

        ``changes`` are the changes of the ROS graph that the manager node discovers.
        ``on_older(instance)`` is called while this system starts, for an instance that started
        before; ``on_permanent(instance)`` once for each instance that has passed that time.
        """
        self._node = node = changes.node
        self._loop = loop
        self._own = own
        self._on_older = on_older
        self._on_permanent = on_permanent
        self._name = node.resolve_service_name(f"~/{INSTANCE_PREFIX}{uuid4().hex}")
        self._known_name = node.resolve_service_name(f"~/{IS_ACTIVE}")
        self._prefix = node.resolve_service_name(f"~/{INSTANCE_PREFIX}")
        self._asked: set[str] = set()  # the services that are being called
        self._changes = changes
        self._checked_change = -1
        self._has_others = False
        self._reported: set[str] = set()  # the services of instances that were reported
        self._add_service()
        self._loop.call_later(_CHECK_PERIOD_S, self._check_start)

    @property
    def participant(self) -> bytes:
        """The prefix of the ids of all endpoints of this process: no other has this service."""
        return b"".join(map(participant, servers_of(self._node, self._name)))

    def check(self) -> None:
        """Look for other instances, and ask those that are not known."""
        change = self._changes.number()
        if change != self._checked_change:
            self._checked_change = change
            # Every manager has this service, and counting is cheaper than listing all services.
            self._has_others = self._node.count_services(self._known_name) > 1
        if not self._has_others:
            return
        found = {
            name
            for name, _ in self._node.get_service_names_and_types()
            if name.startswith(self._prefix) and name != self._name
        }
        self._reported &= found
        for name in sorted(found - self._reported - self._asked):
            if len(self._asked) < _MAX_CALLS:
                self._asked.add(name)
                self._loop.run_task(self._ask(name))

    def _add_service(self) -> None:
        service = self._node.create_service(Trigger, self._name, unused_callback)
        self._loop.add_service(service, self._respond)

    def _respond(self, _: Any, reply: Reply) -> None:
        reply(Trigger.Response(success=True, message=encode(self._own())))

    def _check_start(self) -> None:
        self.check()
        if self._is_starting:
            self._loop.call_later(_CHECK_PERIOD_S, self._check_start)

    @property
    def _is_starting(self) -> bool:
        return self._own().uptime_s < START_S

    async def _ask(self, service: str) -> None:
        client = self._node.create_client(Trigger, service)
        self._loop.add_client(client)
        end_s = self._loop.clock.monotonic() + _RESPONSE_WITHIN_S
        try:
            while not client.service_is_ready() and self._loop.clock.monotonic() < end_s:
                await sleep(self._loop, _CHECK_PERIOD_S)
            called = wrap_future(client.call_async(Trigger.Request()))
            left_s = end_s - self._loop.clock.monotonic()
            self._on_response(service, await within(self._loop, called, left_s))
        except TimeoutError:
            pass  # it is asked again at the next check
        finally:
            self._asked.discard(service)
            self._loop.remove(client)
            self._node.destroy_client(client)

    def _on_response(self, service: str, response: Any) -> None:
        other = parse_instance(response.message)
        if other is None:
            self._reported.add(service)
        elif self._is_starting:
            if is_older(other, self._own()):
                self._on_older(other)
        elif other.uptime_s > START_S:  # otherwise it is about to find out
            self._reported.add(service)
            self._on_permanent(other)
