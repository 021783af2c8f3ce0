"""The loop of ``kind: events``: the composer's scheduler, serving ROS entities."""

from __future__ import annotations

import threading
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node

from composer.runtime.executors.entities.node_executor import NodeExecutor
from composer.runtime.executors.entities.source_group import EntitySource, SourceGroup
from composer.runtime.executors.entities.sources import is_implicit, source_of
from composer.runtime.executors.entity_loop import EntityLoop
from composer.runtime.executors.loop import ExceptionHandler
from composer.runtime.executors.scheduler import Scheduler


class EventLoop(EntityLoop, Scheduler):
    """A :class:`~composer.runtime.executors.loop.Loop` of one thread."""

    def __init__(self, name: str, on_exception: ExceptionHandler) -> None:
        super().__init__(name, on_exception)
        self._group_of: dict[object, SourceGroup] = {}  # by the entity that was added
        self._nodes: dict[Node, _ImplicitEntities] = {}
        self._executor = NodeExecutor(self, lambda: None)
        # rcl has one callback per entity, so two threads must not add it to two groups.
        self._changing = threading.RLock()

    @property
    def _rclpy_executor(self) -> object:
        return self._executor

    def add_node(self, node: Node) -> None:
        """Serve the entities that rclpy creates for a node: services, clock and QoS events."""
        with self._changing:
            self._nodes[node] = _ImplicitEntities(self, node, self._changing)

    def remove_node(self, node: Node) -> None:
        """Stop serving the node and all its entities."""
        with self._changing:
            entities = self._nodes.pop(node, None)
            if entities is not None:
                entities.close()
            for entity in _entities_of(node):
                self.remove(entity)

    def remove(self, entity: object) -> None:
        """Stop serving an entity. Call it before the entity is destroyed."""
        with self._changing:
            group = self._group_of.pop(entity, None)
            if group is not None:
                self.remove_group(group)

    def implicit_source(self, entity: object) -> EntitySource | None:
        """Return the source of an entity that rclpy created, or None if it needs none."""
        return source_of(entity, self._executor, self.run_task)

    def _serve(self, entity: object, source: EntitySource) -> None:
        with self._changing:
            self.remove(entity)
            for entities in self._nodes.values():
                entities.discard(entity)
            self._group_of[entity] = self.add_group(source)


class _ImplicitEntities:
    """The entities of a node that were not added explicitly, served as one group.

    All are rarely used. A file descriptor for each would be thousands in a large system.
    """

    def __init__(self, loop: EventLoop, node: Any, changing: threading.RLock) -> None:
        self._loop = loop
        self._node = node
        self._changing = changing
        self._group = loop.add_group()
        self._sources: dict[object, EntitySource] = {}
        self._update_pending = False
        self._closed = False
        self._executor = NodeExecutor(loop, self._update_soon)  # the node refers to it weakly
        node.executor = self._executor
        for entity in _entities_of(node):
            self._add(entity)

    def discard(self, entity: object) -> None:
        """Stop serving an entity: it was destroyed, or added explicitly."""
        source = self._sources.pop(entity, None)
        if source is not None:
            self._group.discard(source)

    def close(self) -> None:
        """Stop serving the node."""
        self._closed = True
        self._node.executor = None
        self._sources.clear()
        self._loop.remove_group(self._group)

    def _update_soon(self) -> None:
        if not self._update_pending:
            self._update_pending = True
            self._loop.call_soon(self._update)

    def _update(self) -> None:
        """Follow the entities that were created or destroyed meanwhile."""
        with self._changing:
            self._update_pending = False
            if self._closed:
                return
            present = _entities_of(self._node)
            for destroyed in self._sources.keys() - set(present):
                self.discard(destroyed)
            for entity in filter(is_implicit, present):
                self._add(entity)

    def _add(self, entity: object) -> None:
        source = None if entity in self._sources else self._loop.implicit_source(entity)
        if source is None:
            return
        try:
            self._group.add(source)
        except InvalidHandle:
            return  # destroyed meanwhile
        self._sources[entity] = source


def _entities_of(node: Any) -> list[object]:
    return [*node.subscriptions, *node.services, *node.clients, *node.waitables]
