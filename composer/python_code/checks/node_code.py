"""How the code of a node uses the API of behaviors and of rclpy, where syntax shows it."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.base.diagnostics import nearest, suggestion
from composer.interfaces import Interfaces
from composer.interfaces.field_types.types import STATUS, Word
from composer.model import Node
from composer.python_code.checks.messages import message_problems
from composer.python_code.checks.scopes import Code, NodeScope
from composer.python_code.lookup import BehaviorSource, imported_from, is_of_rclpy
from composer.python_code.nodes import (
    UNDECLARED,
    calls_on_self,
    declared_parameters,
    passes_node_on,
    published_port,
    reached_methods,
)
from composer.python_code.problems import Family, Problem
from composer.python_code.stubs.behaviors import PORT_ATTRIBUTES
from composer.python_code.syntax import Method
from composer.python_code.trees import SCOPES, argument, called_name, catches, dotted, span_of, walk

#: The attributes that the composer sets after the constructor.
_SET_LATER = frozenset(
    {"clock", "fail", "log", "node", "parameters", "transforms", *PORT_ATTRIBUTES}
)
#: Texts that show that a file may run an event loop of asyncio, such as in a thread.
_RUNS_ASYNCIO = (
    "asyncio.run",  # and run_coroutine_threadsafe
    "run_until_complete",
    "run_forever",
    "asyncio.Runner",
    "event_loop",
)
#: The parameters that every node has.
_DECLARED = frozenset({"use_sim_time", "start_type_description_service"})
_READING = frozenset({"describe_parameter", "get_parameter", "get_parameter_type"})
_ERRORS = frozenset({"Exception", "ParameterException", "ParameterNotDeclaredException"})
_TRANSITIONS = frozenset({"activate", "cleanup", "configure", "deactivate", "error", "shutdown"})


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
    """Yield awaited functions of asyncio, and QoS profiles that rclpy refuses."""
    runs_asyncio = any(text in scope.source.text for text in _RUNS_ASYNCIO)
    instead = "call self.get_clock().sleep_for, or await a Future that a timer completes"
    if is_behavior:
        instead = "use self.clock.sleep"
    for call in scope.calls:
        is_pause = scope.constant(argument(call.node, 0, "delay")) == 0  # needs no event loop
        given = {item.arg for item in call.node.keywords}
        if call.awaited and call.name.startswith("asyncio.") and not (runs_asyncio or is_pause):
            message = f"'{call.name}' needs the event loop of asyncio, which does not run here"
            hint = instead if call.name == "asyncio.sleep" else None
            yield Problem(Family.ASYNCIO, message, call.span, hint)
        elif call.name == "rclpy.qos.QoSProfile" and not (
            call.node.args or given & {"depth", "history", None}
        ):
            message = "a QoSProfile needs its depth or its history"
            yield scope.problem(Family.ARGUMENTS, message, call.node, "add 'depth=10'")


def _behavior_problems(code: Code) -> Iterator[Problem]:
    """Yield the wrong uses of the API in a behavior."""
    yield from _early_attributes(code)
    for name in ("on_configure", "on_cleanup"):
        method = code.source.method(name)
        for reached in reached_methods(code.source, method) if method is not None else ():
            yield from _early_calls(name, reached, code)
    for scope in code.scopes:
        for node in scope.nodes:
            match node:
                case ast.Subscript(value=ast.Attribute() as owner, slice=index):
                    yield from _key(dotted(owner), index, scope)
                case ast.Compare(left=left, ops=[ast.Eq() | ast.NotEq()], comparators=[right]):
                    word = _word(left, scope)
                    problem = word.problem(scope.constant(right)) if word is not None else None
                    if problem is not None:
                        yield scope.doubt(problem[0], right, problem[1])


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


def _key(owner: str, index: ast.expr, scope: NodeScope) -> Iterator[Problem]:
    """Yield the constant keys of ports and parameters that the node does not have."""
    node, key = scope.code.node, scope.constant(index)
    section = owner.removeprefix("self.") if scope.class_ is not None and node.complete else ""
    kind, names = "parameter", [item.name.value for item in node.parameters]
    if section in PORT_ATTRIBUTES:
        kind = PORT_ATTRIBUTES[section].value
        names = [item.name.value for item in node.ports_of(PORT_ATTRIBUTES[section])]
    elif owner != "self.parameters":
        return
    if isinstance(key, str) and key not in names:
        message = f"the node has no {kind} '{key}'"
        yield scope.problem(Family.PORT, message, index, suggestion(key, names))


def _word(node: ast.expr, scope: NodeScope) -> Word | None:
    """Return the type of a parameter with choices, or of the status of a goal."""
    match node:
        case ast.Attribute(value=ast.Attribute(value=ast.Name(id="self"), attr="parameters")):
            parameter = scope.code.node.parameter(node.attr)
            if parameter is not None and parameter.choices is not None:
                return Word("string", words=tuple(map(str, parameter.choices.value)))
        case ast.Attribute(value=ast.Name(id=name), attr="status"):
            match scope.value(name):
                case ast.Await(value=ast.Call(func=ast.Attribute(attr="result"))):
                    return STATUS
    return None


def _node_class_problems(code: Code) -> Iterator[Problem]:
    """Yield what is wrong about a class that is derived from rclpy's Node."""
    yield from _missing_calls(code)
    if code.source.method("get_parameter") or code.source.method("declare_parameter"):
        return  # they may do something else
    yield from _undeclared(code)


def _undeclared(code: Code) -> Iterator[Problem]:
    """Yield the parameters that methods read, but that no file declares."""
    parameters = declared_parameters(code.source)
    hosted = code.node.hosted_class
    given = {name.value for name, _ in hosted.arguments} if hosted is not None else set()
    if not parameters.is_complete or not UNDECLARED.isdisjoint(given):
        return
    if any(map(_has_other_options, code.scopes)):
        return
    declared = _DECLARED | parameters.types.keys()
    is_shared = passes_node_on(code.source)
    own = {module.source for module in code.source.own_modules}
    for scope, call, method in calls_on_self(code.source):
        name = argument(call, 0, "name") if method in _READING and scope.source in own else None
        read = scope.known(scope.text, name)
        if name is None or read is None or read in declared or read.startswith("qos_overrides."):
            continue
        close = nearest(read, declared)
        is_caught = any(
            isinstance(x, ast.ExceptHandler) and catches(x, _ERRORS) for x in scope.nodes
        )
        if (close or not is_shared) and not is_caught:
            hint = f"did you mean '{close}'?" if close else f"call declare_parameter('{read}')"
            message = f"the class does not declare the parameter '{read}'"
            yield Problem(Family.PARAMETER, message, span_of(name, scope.source), hint)


def _has_other_options(scope: NodeScope) -> bool:
    """Return whether a constructor gets options from elsewhere than from the node's arguments."""
    own = scope.function.args.kwarg if scope.function is not None else None
    passed_on = own.arg if own is not None else None
    calls = (x for x in scope.nodes if isinstance(x, ast.Call) and called_name(x) == "__init__")
    options = (item for call in calls for item in call.keywords if item.arg is None)
    return any(dotted(item.value) != passed_on for item in options)


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
            if origin.name != "LifecycleNode" or transition not in _TRANSITIONS:
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
