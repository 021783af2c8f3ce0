"""How the code of a node uses the API of behaviors and of rclpy, where syntax shows it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from composer.base.diagnostics import nearest
from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.checker.copies import TRANSITIONS
from composer.python_code.checks.messages import Code, NodeScope, message_problems
from composer.python_code.lookup import BehaviorSource, imported_from, is_of_rclpy
from composer.python_code.nodes import (
    calls_on_self,
    declared_parameters,
    published_port,
    reached_methods,
)
from composer.python_code.problems import Family, Problem
from composer.python_code.stubs.behaviors import PORT_ATTRIBUTES
from composer.python_code.syntax import Method
from composer.python_code.trees import SCOPES, argument, span_of, walk

#: The attributes that the composer sets after the constructor.
_SET_LATER = frozenset(
    {"clock", "fail", "log", "node", "parameters", "transforms", *PORT_ATTRIBUTES}
)
#: Text that shows that a file may run an event loop of asyncio, such as in a thread.
_RUNS_ASYNCIO = re.compile(r"asyncio\.(?:run|Runner)|run_until_complete|run_forever|event_loop")
#: The parameters that every node has.
_DECLARED = frozenset({"use_sim_time", "start_type_description_service"})


def code_problems(node: Node, source: BehaviorSource, interfaces: Interfaces) -> Iterator[Problem]:
    """Yield the problems of a behavior or of an rclpy class, in the project's files."""
    code = Code(node, source, interfaces)
    for scope in code.scopes:
        yield from message_problems(scope)
        yield from _calls(scope, is_behavior=node.behavior is not None)
    if node.behavior is not None:
        yield from _behavior_problems(code)
    else:
        yield from _node_class_problems(code)


def _calls(scope: NodeScope, *, is_behavior: bool) -> Iterator[Problem]:
    """Yield awaited functions of asyncio, whose event loop does not run."""
    runs_asyncio = _RUNS_ASYNCIO.search(scope.source.text) is not None
    for call in scope.calls:
        is_pause = scope.constant(argument(call.node, 0, "delay")) == 0  # needs no event loop
        if call.awaited and call.name.startswith("asyncio.") and not (runs_asyncio or is_pause):
            message = f"'{call.name}' needs the event loop of asyncio, which does not run here"
            is_sleep = is_behavior and call.name == "asyncio.sleep"
            hint = "use self.clock.sleep" if is_sleep else None
            yield Problem(Family.ASYNCIO, message, call.span, hint)


def _behavior_problems(code: Code) -> Iterator[Problem]:
    """Yield the wrong uses of the API in a behavior."""
    yield from _early_attributes(code)
    for name in ("on_configure", "on_cleanup"):
        method = code.source.method(name)
        for reached in reached_methods(code.source, method) if method is not None else ():
            yield from _early_calls(name, reached, code)


def _early_attributes(code: Code) -> Iterator[Problem]:
    """Yield what a constructor reads although the composer sets it later."""
    constructor = code.source.method("__init__")
    names = _SET_LATER - code.assigned - {method.name for method in code.source.methods}
    for method in reached_methods(code.source, constructor) if constructor is not None else ():
        nodes = list(walk(method.node.body if method.node else [], closed=SCOPES))
        # A class may be used without the composer, and ask for what is there.
        if any(isinstance(x, ast.Try) or getattr(x, "id", "") == "hasattr" for x in nodes):
            continue
        for node in nodes:
            match node:
                case ast.Attribute(value=ast.Name(id="self"), attr=name) if name in names:
                    message = f"'self.{name}' is not set in the constructor"
                    span = span_of(node, method.span.file)
                    yield Problem(Family.EARLY, message, span, "move this to on_configure")
                    return  # the others have the same cause


def _early_calls(handler: str, method: Method, code: Code) -> Iterator[Problem]:
    """Yield what a method sends, called by a handler while the node is not active."""
    nodes = walk([method.node] if method.node is not None else [])
    if any(isinstance(node, ast.Try | ast.If) for node in nodes):
        return  # it may know
    for call in method.calls:
        group, _, rest = call.name.removeprefix("self.").partition(".")
        port = code.node.port(rest.partition(".")[0]) if group in PORT_ATTRIBUTES else None
        if port is None or port.always_on or call.deferred:
            continue
        message = f"'{handler}' runs while the node is not active: "
        hint = "move it to on_activate"
        if published_port(call.name) is not None:
            message += "the message is dropped"
            yield Problem(Family.EARLY, message, call.span, hint, is_certain=False)
        elif call.name.endswith((".call", ".send_goal")):
            message += "this raises CallCancelled"
            yield Problem(Family.EARLY, message, call.span, hint)


def _node_class_problems(code: Code) -> Iterator[Problem]:
    """Yield what is wrong about a class that is derived from rclpy's Node."""
    yield from _missing_calls(code)
    if code.source.method("get_parameter") or code.source.method("declare_parameter"):
        return  # they may do something else
    yield from _undeclared(code)


def _undeclared(code: Code) -> Iterator[Problem]:
    """Yield the parameters that methods read under a name close to a declared one.

    Other names may be declared by code that is not read.
    """
    parameters = declared_parameters(code.source)
    declared = _DECLARED | parameters.types.keys()
    for scope, call, method in calls_on_self(code.source) if parameters.is_complete else ():
        name = argument(call, 0, "name") if method == "get_parameter" else None
        read = scope.known(scope.text, name)
        close = nearest(read, declared - {read}) if read is not None else None
        if name is not None and read not in declared and close is not None:
            message = f"the class does not declare the parameter '{read}'"
            hint = f"did you mean '{close}'?"
            yield Problem(Family.PARAMETER, message, span_of(name, scope.source), hint)


def _missing_calls(code: Code) -> Iterator[Problem]:
    """Yield the methods that do not call the base class's method, and wrong transitions."""
    has_publishers = any(
        isinstance(node, ast.Attribute) and node.attr == "create_lifecycle_publisher"
        for scope in code.scopes
        for node in scope.nodes
    )
    for module, class_ in code.source.own_classes:
        origin = imported_from(module, class_.bases[0]) if len(class_.bases) == 1 else None
        if origin is None or not is_of_rclpy(origin):
            continue
        for method in class_.methods:
            transition = method.name.removeprefix("on_")
            if not method.known or method.node is None:
                continue
            if method.name == "__init__" and not _calls_base(class_.node, "__init__"):
                message = f"the constructor of '{class_.name}' does not call that of {origin.name}"
                hint = "begin with super().__init__('name_of_the_node')"
                yield Problem(Family.CONSTRUCTOR, message, method.span, hint)
            if origin.name != "LifecycleNode" or transition not in TRANSITIONS:
                continue
            if not method.accepts(1):
                takes = ", ".join(("self", *method.arguments))
                message = f"'{method.name}' is called with the state, but takes ({takes})"
                hint = f"write 'def {method.name}(self, state)'"
                yield Problem(Family.SIGNATURE, message, method.span, hint)
            is_switch = transition in ("activate", "deactivate")
            if is_switch and has_publishers and not _calls_base(method.node, method.name):
                message = f"'{method.name}' does not {transition} the lifecycle publishers"
                hint = f"end it with 'return super().{method.name}(state)'"
                values = [
                    x.value for x in method.node.body if isinstance(x, ast.Return) and x.value
                ]
                span = span_of(values[-1], module.source) if values else method.span
                yield Problem(Family.CONSTRUCTOR, message, span, hint, is_certain=False)


def _calls_base(node: ast.AST, name: str) -> bool:
    """Return whether code may call a method ``name`` of another class."""
    return any(isinstance(x, ast.Attribute) and x.attr in (name, "__new__") for x in walk([node]))
