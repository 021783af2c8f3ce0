"""Names that are used in a Python file but defined nowhere."""

from __future__ import annotations

import ast
import builtins
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field

from composer.behavior_source.traversal import children, walk
from composer.fast_dataclass import dataclass

_MODULE_NAMES = frozenset(
    {*dir(builtins), "__file__", "__path__", "__annotations__", "__builtins__", "__module__"}
    | {"__qualname__", "__class__", "WindowsError"}
)
#: Functions with which a name can be defined without a statement that shows it.
_DYNAMIC = frozenset({"exec", "eval", "globals", "locals", "vars"})
_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
#: Nodes with scopes or annotations.
_SPECIAL = (*_DEFINITIONS, ast.Lambda, *_COMPREHENSIONS, ast.AnnAssign)


@dataclass(slots=True)
class _Scope:
    names: set[str] = field(default_factory=set)
    is_class: bool = False


def undefined_names(tree: ast.Module) -> Iterator[tuple[ast.Name, frozenset[str]]]:
    """Yield each undefined name where it is first used, with the names that are defined there.

    Annotations are left out where Python does not evaluate them: in functions, and everywhere with
    ``from __future__ import annotations``. So is a file with names that its syntax does not show,
    such as those of ``from module import *``.
    """
    nodes = list(walk(tree.body))
    if any(_is_dynamic(node) for node in nodes):
        return
    module = _Scope(set(_MODULE_NAMES) | set(_defined(tree.body)) | set(_globals(nodes)))
    seen: set[str] = set()
    for name, known in _uses(tree.body, (module,), not _postpones_annotations(tree)):
        if name.id not in seen:
            seen.add(name.id)
            yield name, known


def _uses(
    body: Iterable[ast.AST], outer: tuple[_Scope, ...], with_annotations: bool
) -> Iterator[tuple[ast.Name, frozenset[str]]]:
    """Yield the undefined names in ``body``, which sees the names of the scopes ``outer``."""
    pending = [(node, outer) for node in body][::-1]
    while pending:
        node, scopes = pending.pop()
        if isinstance(node, ast.Name):
            if isinstance(node.ctx, ast.Load) and not any(node.id in one.names for one in scopes):
                yield node, frozenset().union(*(scope.names for scope in scopes))
        elif isinstance(node, _SPECIAL):
            pending += [*_evaluated(node, scopes)][::-1]
            if with_annotations:
                pending += [(item, scopes) for item in _annotations(node, scopes)][::-1]
        else:
            pending += [(item, scopes) for item in children(node)[::-1]]


def _evaluated(
    node: ast.AST, scopes: tuple[_Scope, ...]
) -> Iterator[tuple[ast.AST, tuple[_Scope, ...]]]:
    """Yield the parts of a special node that are evaluated, with the scopes that each sees."""
    visible = tuple(scope for scope in scopes if not scope.is_class)  # methods do not see classes
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.Lambda():
            outside: list[ast.AST] = [*node.args.defaults, *filter(None, node.args.kw_defaults)]
            outside += getattr(node, "decorator_list", [])
            body = node.body if isinstance(node.body, list) else [node.body]
            for name in _only_changed(node, body):
                known = set().union(*(scope.names for scope in visible))
                yield name, (_Scope(known - {name.id}),)
            inside = (*visible, _Scope({*_arguments(node.args), *_defined(body), *_types(node)}))
            yield from ((item, scopes) for item in outside)
            yield from ((item, inside) for item in body)
        case ast.ClassDef():
            head = [*node.decorator_list, *node.bases, *(item.value for item in node.keywords)]
            within = (*visible, _Scope(set(_types(node))))
            yield from ((item, (*within, *scopes)) for item in head)
            inside = (*within, _Scope(set(_defined(node.body)), is_class=True))
            yield from ((item, inside) for item in node.body)
        case ast.ListComp() | ast.SetComp() | ast.DictComp() | ast.GeneratorExp():
            names = {name for item in node.generators for name in _stored(item.target)}
            # The first iterable sees a class around it; for simplicity, all of it does.
            inside = (*scopes, _Scope(names))
            yield from ((item, inside) for item in children(node))
        case ast.AnnAssign():
            yield node.target, scopes
            if node.value is not None:
                yield node.value, scopes


def _annotations(node: ast.AST, scopes: tuple[_Scope, ...]) -> Iterator[ast.expr]:
    """Yield the annotations of a node that Python 3.12 evaluates."""
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef() if not any(_types(node)):
            arguments = (item for item in ast.walk(node.args) if isinstance(item, ast.arg))
            written = [node.returns, *(item.annotation for item in arguments)]
            found = [item for item in written if item is not None]
            yield from sorted(found, key=lambda item: (item.lineno, item.col_offset))
        case ast.AnnAssign(annotation=annotation) if len(scopes) == 1 or scopes[-1].is_class:
            yield annotation


def _postpones_annotations(tree: ast.Module) -> bool:
    return any(
        isinstance(node, ast.ImportFrom)
        and node.module == "__future__"
        and any(item.name == "annotations" for item in node.names)
        for node in tree.body
    )


def _defined(body: Iterable[ast.AST]) -> Iterator[str]:
    """Yield the names that ``body`` binds in its own scope."""
    pending = list(body)
    while pending:
        node = pending.pop()
        match node:
            case ast.Name(id=name, ctx=ast.Store() | ast.Del()):
                yield name
            case (
                ast.FunctionDef(name=name)
                | ast.AsyncFunctionDef(name=name)
                | ast.ClassDef(name=name)
            ):
                yield name
                continue
            case ast.alias(name=name, asname=other):
                yield other or name.partition(".")[0]
            case ast.ExceptHandler(name=str() as name):
                yield name
            case ast.MatchAs(name=str() as name) | ast.MatchStar(name=str() as name):
                yield name
            case ast.MatchMapping(rest=str() as name):
                yield name
            case ast.Global(names=names) | ast.Nonlocal(names=names):
                yield from names
        if isinstance(node, _COMPREHENSIONS):  # only ':=' binds a name outside
            inner = (part for part in ast.walk(node) if isinstance(part, ast.NamedExpr))
            yield from (part.target.id for part in inner)
        elif not isinstance(node, ast.Lambda):
            pending.extend(children(node))


def _only_changed(node: ast.AST, body: Sequence[ast.AST]) -> Iterator[ast.Name]:
    """Yield the names of a function that it changes, as in ``count += 1``, but never sets.

    They are local to it, so the names around it do not count.
    """
    changed = [
        inner.target
        for inner in walk(body, closed=(*_DEFINITIONS, ast.Lambda))
        if isinstance(inner, ast.AugAssign) and isinstance(inner.target, ast.Name)
    ]
    if not changed:
        return
    bound = Counter(_defined(body))
    arguments = {item.arg for item in walk([node]) if isinstance(item, ast.arg)}
    times = Counter(target.id for target in changed)
    for target in changed:
        if bound[target.id] == times[target.id] and target.id not in arguments:
            yield ast.copy_location(ast.Name(f"{target.id}", ast.Load()), target)


def _globals(nodes: Iterable[ast.AST]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.Global):
            yield from node.names


def _stored(target: ast.expr) -> Iterator[str]:
    yield from (node.id for node in ast.walk(target) if isinstance(node, ast.Name))


def _arguments(arguments: ast.arguments) -> Iterator[str]:
    yield from (node.arg for node in ast.iter_child_nodes(arguments) if isinstance(node, ast.arg))


def _types(node: ast.AST) -> Iterator[str]:
    """Yield the type parameters of a function or a class, which Python 3.12 introduced."""
    yield from (item.name for item in getattr(node, "type_params", ()))


def _is_dynamic(node: ast.AST) -> bool:
    if isinstance(node, ast.alias):
        return node.name == "*"
    return isinstance(node, ast.Name) and node.id in _DYNAMIC
