"""Named tuples that are made by a call, as in ``Point = namedtuple("Point", "x y")``."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from composer.behavior_source.method_body import dotted

_MAKERS = frozenset({"collections.namedtuple", "typing.NamedTuple"})
_PAIR = 2


def called_tuples(
    statements: Iterable[ast.stmt], names: Mapping[str, str]
) -> Iterator[ast.ClassDef]:
    """Yield the named tuples of a file that are assigned once, each as a class of the same fields.

    ``names`` are the full names of what the file imports.
    """
    assigned = Counter(
        target.id
        for item in statements
        if isinstance(item, ast.Assign)
        for target in item.targets
        if isinstance(target, ast.Name)
    )
    for item in statements:
        match item:
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Call() as call):
                head, dot, rest = dotted(call.func).partition(".")
                maker = f"{names.get(head, head)}{dot}{rest}"
                if maker in _MAKERS and assigned[name] == 1:
                    fields = _fields(call)
                    if fields is not None:
                        yield _class(name, fields, call)


_Fields = list[tuple[str, ast.expr, ast.expr | None]]


def _fields(call: ast.Call) -> _Fields | None:
    """Return the names, annotations and defaults of the fields, None if they are not known."""
    given = {keyword.arg: keyword.value for keyword in call.keywords}
    if len(call.args) != _PAIR or given.keys() - {"defaults"}:
        return None
    unknown = ast.copy_location(ast.Name("object", ast.Load()), call)
    found: list[tuple[str, ast.expr]] = []
    match call.args[1]:
        case ast.Constant(value=str() as text):
            found = [(name, unknown) for name in text.replace(",", " ").split()]
        case ast.List(elts=items) | ast.Tuple(elts=items):
            for item in items:
                match item:
                    case ast.Constant(value=str() as name):
                        found.append((name, unknown))
                    case ast.Tuple(elts=[ast.Constant(value=str() as name), annotation]):
                        found.append((name, annotation))
                    case _:
                        return None
        case _:
            return None
    defaults: list[ast.expr] = []
    match given.get("defaults"):
        case ast.List(elts=items) | ast.Tuple(elts=items):
            defaults = items
        case None:
            pass
        case _:
            return None
    has_unpacked = any(isinstance(item, ast.Starred) for item in defaults)
    if has_unpacked or len(defaults) > len(found):
        return None
    values = [*[None] * (len(found) - len(defaults)), *defaults]
    return [(name, type_, value) for (name, type_), value in zip(found, values, strict=True)]


def _class(name: str, fields: _Fields, call: ast.Call) -> ast.ClassDef:
    body: list[ast.stmt] = [
        ast.AnnAssign(ast.Name(field, ast.Store()), annotation, value, 1)
        for field, annotation, value in fields
    ]
    base = ast.Attribute(ast.Name("typing", ast.Load()), "NamedTuple", ast.Load())
    made = ast.ClassDef(name=name, bases=[base], keywords=[], body=body, decorator_list=[])
    for node in ast.walk(made):
        if "lineno" in node._attributes and not hasattr(node, "lineno"):
            ast.copy_location(node, call)
    return made
