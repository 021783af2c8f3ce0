"""The stubs of rclpy that are shipped agree with the rclpy that is installed."""

from __future__ import annotations

import ast
import importlib
import inspect
import sys
from functools import cache
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest
import rclpy.action.client
import rclpy.node

import composer

pytestmark = [pytest.mark.ros, pytest.mark.filterwarnings("ignore:importing 'qos_event'")]

FOLDER = Path(composer.__file__).parent / "python_code" / "stubs" / "libraries" / "rclpy"
MODULES = {
    ".".join(path.relative_to(FOLDER.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(FOLDER.rglob("*.pyi"))
}
IMPORTS = ast.Import | ast.ImportFrom
#: What functions with `*args` or `**kwargs` pass their arguments on to.
PASSED_ON: dict[str, Any] = {
    "LifecycleNode.__init__": rclpy.node.Node.__init__,
    "LifecycleNodeMixin.create_lifecycle_publisher": rclpy.node.Node.create_publisher,
    "ActionClient.send_goal": rclpy.action.client.ActionClient.send_goal_async,
}
#: Services of every node: a node creates them, and users do not import them.
INTERNAL = {f"rclpy.{name}_service" for name in ("logging", "parameter", "type_description")} | {
    "rclpy.time_source",
    "rclpy.impl.implementation_singleton",
}


def names(body: list[ast.stmt]) -> dict[str, ast.stmt]:
    """The names that statements of a stub define; of overloads and setters the first one."""
    found: dict[str, ast.stmt] = {}
    for item in body:
        match item:
            case ast.ImportFrom(module=str(source), names=[ast.alias(name="*")]):
                found |= names(ast.parse(MODULES[source].read_text()).body)
            case ast.Import() | ast.ImportFrom():
                found |= {alias.asname or alias.name: item for alias in item.names}
            case ast.ClassDef() | ast.FunctionDef() | ast.AsyncFunctionDef():
                found.setdefault(item.name, item)
            case ast.AnnAssign(target=ast.Name(id=name)) | ast.Assign(targets=[ast.Name(id=name)]):
                found[name] = item
    return found


@cache  # when the first test needs it: each worker imports this module
def stubs() -> dict[str, dict[str, ast.stmt]]:
    """The names of each stub."""
    return {module: names(ast.parse(path.read_text()).body) for module, path in MODULES.items()}


@cache
def classes() -> dict[str, ast.ClassDef]:
    return {
        f"{module}.{name}": item
        for module, stub in stubs().items()
        for name, item in stub.items()
        if isinstance(item, ast.ClassDef) and not name.startswith("_")
    }


@cache
def functions() -> dict[str, Any]:
    owners = {**stubs(), **{key: names(item.body) for key, item in classes().items()}}
    return {
        f"{owner}.{name}": item
        for owner, stub in owners.items()
        for name, item in stub.items()
        if isinstance(item, ast.FunctionDef | ast.AsyncFunctionDef)
        and (name in {"__init__", "__new__"} or not name.startswith("_"))
    }


def find(name: str) -> Any:
    owner, _, attribute = name.rpartition(".")
    holder = importlib.import_module(owner) if owner in MODULES else find(owner)
    return inspect.getattr_static(holder, attribute)


def attributes(cls: type) -> set[str]:
    """What the class itself has, with what its methods set: `self.x = ...`.

    The source is read, since hosted nodes replace some methods of a process.
    """
    try:
        [own] = ast.parse(dedent(inspect.getsource(cls))).body
    except (OSError, TypeError):  # compiled
        own = ast.Pass()
    stored = {
        item.attr
        for function in getattr(own, "body", ())
        if isinstance(function, ast.FunctionDef)
        for item in ast.walk(function)
        if isinstance(item, ast.Attribute) and isinstance(item.ctx, ast.Store)
        if isinstance(item.value, ast.Name) and item.value.id == "self"
    }
    return stored | set(vars(cls)) | set(cls.__annotations__)


@pytest.mark.parametrize("module", MODULES)
def test_no_name_of_a_module_is_missing_or_made_up(module: str) -> None:
    stub, real = stubs()[module], importlib.import_module(module)
    public = {
        name: getattr(value, "__module__", "" if name.isupper() else "sys")
        for name, value in vars(real).items()
        if not name.startswith("_") and not inspect.ismodule(value) and name != "TYPE_CHECKING"
    }
    for name, source in public.items():
        own = source == module or source.split(".")[0] not in sys.stdlib_module_names
        if "__getattr__" not in stub and (source == module if module in INTERNAL else own):
            assert name in stub
    defined = {name for name, item in stub.items() if not isinstance(item, IMPORTS)}
    assert {name for name in defined if name[0] != "_" and not hasattr(real, name)} == set()


def test_no_attribute_of_a_class_is_missing_or_made_up() -> None:
    described = {find(name): set(names(item.body)) for name, item in classes().items()}
    for cls, defined in described.items():
        own = [base for base in cls.__mro__ if base.__module__.startswith("rclpy")]
        standard = {key for base in cls.__mro__ if base not in own for key in dir(base)}
        exist = {key for base in own for key in attributes(base)} | standard
        known = {key for base in own for key in described.get(base, ())}
        missing = {key for key in exist - standard - known if not key.startswith("_")}
        # Members of enumerations have a name and a value; an exception imports the class Parameter.
        assert missing - {"name", "value", "Parameter"} == set(), cls
        assert defined - exist - {"value", "_value_"} == set(), cls


def test_functions_take_what_those_of_rclpy_take() -> None:
    real = {name: getattr(find(name), "__func__", find(name)) for name in functions()}
    # The others are properties, or compiled.
    plain = {name: item for name, item in real.items() if inspect.isfunction(item)}
    assert len(plain) > 200
    for name, function in plain.items():
        check_parameters(name, [*inspect.signature(function).parameters.values()])


def check_parameters(name: str, parameters: list[inspect.Parameter]) -> None:
    """Check that the stub of a function takes these parameters."""
    expected = [
        item for item in parameters if item.kind not in {item.VAR_KEYWORD, item.VAR_POSITIONAL}
    ]
    stub = functions()[name].args
    plain = [item.arg for item in (*stub.posonlyargs, *stub.args)]
    optional = {*plain[len(plain) - len(stub.defaults) :]}
    keywords = {
        item.arg: default is not None
        for item, default in zip(stub.kwonlyargs, stub.kw_defaults, strict=True)
    }
    described = {item: item in optional for item in plain} | keywords
    for item in expected:
        if item.name in described:
            assert (item.default is not item.empty) == described[item.name], (name, item)
            assert (item.kind is item.KEYWORD_ONLY) == (item.name in keywords), (name, item)
    if len(expected) == len(parameters):
        assert [item.name for item in expected] == list(described), name
    elif passed_on := PASSED_ON.get(".".join(name.rsplit(".", 2)[1:])):
        known = {item.name for item in expected} | {*inspect.signature(passed_on).parameters}
        assert set(described) <= known, name
