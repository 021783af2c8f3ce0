"""Functions that are passed to rclpy or the composer, and cannot be called as they are."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from composer.python_code.checks.scopes import Scope
from composer.python_code.problems import Family, Problem
from composer.python_code.source import Function
from composer.python_code.source.flow import returns_nothing
from composer.python_code.source.method_body import argument, dotted
from composer.python_code.source.syntax import name_span

#: The callbacks by what takes them: their position (99: none) and name, and the numbers of
#: arguments that they may take.
_CALLBACKS: Mapping[str, Mapping[str, tuple[int, tuple[int, ...]]]] = {
    "create_guard_condition": {"callback": (0, (0,))},
    "create_service": {"callback": (2, (2,))},
    "create_subscription": {"callback": (2, (1, 2))},
    "create_timer": {"callback": (1, (0,))},
    "add_done_callback": {"callback": (0, (1,))},
    "add_on_set_parameters_callback": {"callback": (0, (1,))},
    "send_goal": {"on_feedback": (99, (1,))},
    "send_goal_async": {"feedback_callback": (1, (1,))},
    "ActionServer": {
        "execute_callback": (3, (1,)),
        "goal_callback": (99, (1,)),
        "cancel_callback": (99, (1,)),
        "handle_accepted_callback": (99, (1,)),
    },
}


class _Callable(NamedTuple):
    """A function with the scope around it, and what is passed to it before other arguments."""

    node: Function | ast.Lambda
    scope: Scope
    bound: int = 0
    keywords: frozenset[str] = frozenset()

    def accepts(self, count: int) -> bool:
        """Return whether it can be called with ``count`` positional arguments."""
        arguments = self.node.args
        names = [item.arg for item in (*arguments.posonlyargs, *arguments.args)]
        needed = names[self.bound : len(names) - len(arguments.defaults)]
        free = names[self.bound :]
        places = [free.index(name) for name in self.keywords if name in free]
        most = min([len(names) - self.bound, *places])
        pairs = zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
        by_name = {item.arg for item, default in pairs if default is None}
        least = sum(name not in self.keywords for name in needed)
        is_enough = least <= count and by_name <= self.keywords
        return is_enough and (count <= most or arguments.vararg is not None)


def callback_problems(scope: Scope) -> Iterator[Problem]:
    """Yield the callbacks that cannot be called, are called at once, or return nothing."""
    for call in scope.nodes:
        if not isinstance(call, ast.Call):
            continue
        owner, _, name = dotted(call.func).rpartition(".")
        name = name or getattr(call.func, "attr", "")
        is_own = owner == "self" and scope.code.source.method(name) is not None
        is_of_node = owner in ("self", "self.node") or not name.startswith("create_")
        taken = _CALLBACKS.get(name, {}) if is_of_node and not is_own else {}
        for role, (position, counts) in taken.items():
            callback = argument(call, position, role)
            if callback is not None:
                yield from _problems(callback, role, counts, scope)


def _problems(
    node: ast.expr, role: str, counts: tuple[int, ...], scope: Scope
) -> Iterator[Problem]:
    called = _callable(node.func, scope) if isinstance(node, ast.Call) else None
    if called is not None and isinstance(called.node, Function):
        if isinstance(called.node, ast.AsyncFunctionDef) or returns_nothing(called.node):
            message = "the function is called here, not passed"
            hint = f"write {ast.unparse(node.func)} without '()'"  # type: ignore[attr-defined]
            yield scope.problem(Family.SIGNATURE, message, node, hint)
        return
    function = _callable(node, scope)
    if function is None:
        return
    span = scope.problem(Family.SIGNATURE, "", node).span
    what = "this function"
    takes = ""
    if isinstance(function.node, Function):
        what = f"'{function.node.name}'"
        arguments = function.node.args
        names = ", ".join(item.arg for item in (*arguments.posonlyargs, *arguments.args))
        takes = f", but takes ({names})"
        if not isinstance(node, ast.Call):  # of a partial, what is passed may be wrong
            span = name_span(function.node, "def", function.scope.module.source)
    if not any(map(function.accepts, counts)):
        passed = f"{counts[0] or 'no'} argument{'s' if counts[0] > 1 else ''}"
        message = f"{what} is called with {passed} as '{role}'{takes}"
        yield Problem(Family.SIGNATURE, message, span)
    result = "response" if counts == (2,) else "result" if role == "execute_callback" else ""
    if result and isinstance(function.node, Function) and returns_nothing(function.node):
        message = f"{what} must return the {result}, but may end without a 'return'"
        yield Problem(Family.RETURN, message, span, f"end it with 'return {result}'")


def _callable(node: ast.expr, scope: Scope) -> _Callable | None:
    """Return the function of the project that an expression is, None if it is not known."""
    outside = scope.code.modules[scope.module.path]
    match node:
        case ast.Lambda():
            return _Callable(node, scope)
        case ast.Attribute(value=ast.Name(id="self"), attr=name) if scope.method is not None:
            home = scope.code.methods.get(name)
            if home is not None and home.function is not None and name not in scope.code.assigned:
                is_known = home.method is not None and home.method.known
                is_static = any(dotted(x) == "staticmethod" for x in home.function.decorator_list)
                return _Callable(home.function, home, 1 - is_static) if is_known else None
        case ast.Name(id=name):
            home = scope if name in scope.bindings else outside
            match home.bindings.get(name):
                case [ast.FunctionDef() | ast.AsyncFunctionDef() as function]:
                    is_seen = home is scope or function in outside.module.tree.body
                    is_plain = is_seen and not function.decorator_list
                    return _Callable(function, home) if is_plain else None
        case ast.Call(func=called, args=[first, *rest], keywords=keywords):
            inner = _callable(first, scope) if not isinstance(first, ast.Call) else None
            names = frozenset(item.arg for item in keywords if item.arg is not None)
            is_known = len(names) == len(keywords) and not any(
                isinstance(item, ast.Starred) for item in rest
            )
            if inner is not None and is_known and scope.full_name(called) == "functools.partial":
                bound = inner.bound + len(rest)
                return inner._replace(bound=bound, keywords=inner.keywords | names)
    return None
