"""Runs the reactions of YAML: what a node does when something happens."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol, TypeAlias

from composer.behavior import Publisher
from composer.language.expressions import EvaluationError, Expression
from composer.language.templates import Template, evaluate
from composer.model import Reaction
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.ros.messages import Build, compile_message

#: The characters and items of a state variable. A reaction that appends to its own state, such as
#: the text of each message, would otherwise use up the memory.
MAX_STATE_SIZE = 1_000_000
#: The publisher and client ports of a node, by name.
Publishers: TypeAlias = Mapping[str, Publisher[Any]]
Action: TypeAlias = Callable[[dict[str, Any]], None]


class ReactionClient(Protocol):
    """A client or action client port, through which a reaction sends requests and goals."""

    @property
    def content_type(self) -> Any:
        """The class of requests or goals."""

    def send(self, content: Any) -> None:
        """Send it; the port's own reactions handle the response."""


class MessageReaction(Protocol):
    """What a message triggers before the handler is called."""

    def run(self, *, message: Any) -> Any:
        """Run it."""


Clients: TypeAlias = Mapping[str, ReactionClient]


class RunningReaction:
    """A reaction of one node, compiled when the node is configured.

    ``count`` includes the runs for which ``when`` was false, so that ``count % 10 == 0`` means
    every tenth message.
    """

    __slots__ = ("_actions", "_context", "_needs_now", "_respond", "_when", "count")

    def __init__(
        self,
        context: NodeContext,
        reaction: Reaction,
        publishers: Publishers,
        clients: Clients,
        response_type: Any = None,
    ) -> None:
        """Compile it. Raises MessageError for content that never fits its message type."""
        self._context = context
        self._when = reaction.when.value.holds if reaction.when is not None else None
        self._actions = tuple(_actions(context, reaction, publishers, clients))
        self._respond: Build | None = None
        if reaction.respond is not None and response_type is not None:
            self._respond = compile_message(reaction.respond, response_type, "'respond'")
        self._needs_now = any(uses_now(expression) for expression, _ in reaction.expressions())
        self.count = 0

    def run(self, **values: Any) -> Any:
        """Run it with ``values`` in scope; return the response, if it has one.

        Raises EvaluationError and MessageError.
        """
        scope = self._context.names | values
        scope["count"] = self.count
        if self._needs_now:
            scope["now"] = self._context.now_s()
        self.count += 1
        if self._when is not None and not self._when(scope):
            return None
        for action in self._actions:
            action(scope)
        return self._respond(scope) if self._respond is not None else None


def uses_now(expression: Expression) -> bool:
    """Return whether ``expression`` uses the time."""
    return any(path.root == "now" for path in expression.paths)


def _actions(
    context: NodeContext, reaction: Reaction, publishers: Publishers, clients: Clients
) -> Iterable[Action]:
    if reaction.state:
        yield _set_state(context.names["state"], reaction)
    if reaction.log is not None:
        yield _write_log(context, reaction, reaction.log)
    for send in reaction.publish:
        publisher = publishers[send.port.value]
        what = f"'publish' to '{send.port.value}'"
        yield _send(compile_message(send.content, publisher.message_type, what), publisher.publish)
    for send in reaction.call:
        client = clients[send.port.value]
        what = f"'call' of '{send.port.value}'"
        yield _send(compile_message(send.content, client.content_type, what), client.send)


def _set_state(state: dict[str, Any], reaction: Reaction) -> Action:
    entries = [(name.value, content) for name, content in reaction.state]

    def set_state(scope: dict[str, Any]) -> None:
        # Evaluate all values with the old state before any is stored.
        state.update({name: _bounded(name, evaluate(content, scope)) for name, content in entries})

    return set_state


def _bounded(name: str, value: Any) -> Any:
    """Return ``value``. Raises EvaluationError if it is too large to be stored."""
    if isinstance(value, str | list | dict) and not _fits(value):
        raise EvaluationError(
            f"'set' of '{name}': the value has more than {MAX_STATE_SIZE} characters and items"
        )
    return value


def _fits(value: Any) -> bool:
    left = MAX_STATE_SIZE
    pending = [value]
    while pending and left >= 0:
        item = pending.pop()
        if isinstance(item, str | list | dict):
            left -= len(item)
            if not isinstance(item, str):
                pending += item.values() if isinstance(item, dict) else item
    return left >= 0


def _write_log(context: NodeContext, reaction: Reaction, content: Template) -> Action:
    level = reaction.log_level

    def write_log(scope: dict[str, Any]) -> None:
        if context.log.is_enabled_for(level):
            context.log.write(level, str(evaluate(content, scope)))

    return write_log


def _send(build: Build, send: Callable[[Any], None]) -> Action:
    return lambda scope: send(build(scope))
