"""Carries out what YAML says is to happen when something happens."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol, TypeAlias

from composer.behavior import Publisher
from composer.expressions import Expression
from composer.model import Reaction
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.ros.messages import Build, compile_message
from composer.templates import Template, evaluate, expressions_in


class Caller(Protocol):
    """A client or action client port: what a reaction sends requests and goals through."""

    @property
    def content_type(self) -> Any:
        """The class of what is sent."""

    def send(self, content: Any) -> None:
        """Send it and let the port's own reactions deal with what comes back."""


#: The publisher and client ports of a node, by name.
Publishers: TypeAlias = Mapping[str, Publisher]
Callers: TypeAlias = Mapping[str, Caller]
Action: TypeAlias = Callable[[dict[str, Any]], None]


class RunningReaction:
    """A reaction of one node, compiled when the node is configured.

    ``count`` counts every time it was asked to run, also when ``when`` was false, so that
    ``count % 10 == 0`` means every tenth message.
    """

    __slots__ = ("_actions", "_core", "_needs_now", "_respond", "_when", "count")

    def __init__(
        self,
        core: NodeContext,
        reaction: Reaction,
        publishers: Publishers,
        callers: Callers,
        response_type: Any = None,
    ) -> None:
        """Compile it. Raises MessageError for what can never become the message it is to be."""
        self._core = core
        self._when = reaction.when.holds if reaction.when is not None else None
        self._actions = tuple(_actions(core, reaction, publishers, callers))
        self._respond: Build | None = None
        if reaction.respond is not None and response_type is not None:
            self._respond = compile_message(reaction.respond, response_type, "'respond'")
        self._needs_now = any(uses_now(expression) for expression in _expressions(reaction))
        self.count = 0

    def run(self, **values: Any) -> Any:
        """Carry it out with ``values`` in scope and return the response, where there is one.

        Raises EvaluationError and MessageError.
        """
        scope = self._core.names | values
        scope["count"] = self.count
        if self._needs_now:
            scope["now"] = self._core.now_s()
        self.count += 1
        if self._when is not None and not self._when(scope):
            return None
        for action in self._actions:
            action(scope)
        return self._respond(scope) if self._respond is not None else None


def uses_now(expression: Expression) -> bool:
    """Say whether the time has to be looked up for ``expression``."""
    return any(path.root == "now" for path in expression.paths)


def _expressions(reaction: Reaction) -> Iterable[Expression]:
    if reaction.when is not None:
        yield reaction.when
    templates: list[Template | None] = [content for _, content in reaction.state]
    templates += [send.content for send in (*reaction.publish, *reaction.call)]
    templates += [reaction.log, reaction.respond]
    for template in templates:
        if template is not None:
            yield from (expression for expression, _ in expressions_in(template))


def _actions(
    core: NodeContext, reaction: Reaction, publishers: Publishers, callers: Callers
) -> Iterable[Action]:
    if reaction.state:
        yield _set_state(core.names["state"], reaction)
    if reaction.log is not None:
        yield _write_log(core, reaction, reaction.log)
    for send in reaction.publish:
        publisher = publishers[send.port.value]
        what = f"'publish' to '{send.port.value}'"
        yield _send(compile_message(send.content, publisher.message_type, what), publisher.publish)
    for send in reaction.call:
        caller = callers[send.port.value]
        what = f"'call' of '{send.port.value}'"
        yield _send(compile_message(send.content, caller.content_type, what), caller.send)


def _set_state(state: dict[str, Any], reaction: Reaction) -> Action:
    entries = [(name.value, content) for name, content in reaction.state]

    def set_state(scope: dict[str, Any]) -> None:
        # Every value is worked out from the old state before any is stored.
        state.update({name: evaluate(content, scope) for name, content in entries})

    return set_state


def _write_log(core: NodeContext, reaction: Reaction, content: Template) -> Action:
    level = reaction.log_level

    def write_log(scope: dict[str, Any]) -> None:
        if core.log.is_on(level):
            core.log.write(level, str(evaluate(content, scope)))

    return write_log


def _send(build: Build, send: Callable[[Any], None]) -> Action:
    return lambda scope: send(build(scope))
