"""An interface type that does not exist."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, Label, error, nearest, shown
from composer.interfaces import Interfaces, InvalidDefinition
from composer.interfaces.index import similar_interface
from composer.interfaces.sources import FOLDERS
from composer.model import Port
from composer.source import shown_path

RULE = error(
    code="RC301",
    name="unknown-interface",
    summary=(
        "A port's type is neither installed nor defined in an interface package of the project."
    ),
    why="Without the definition, the port cannot be created, and its uses cannot be checked.",
    bad="""\
system: types
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/Strin, qos: command, external: true}}
""",
    good="""\
system: types
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look up the type of every port."""
    hints: dict[tuple[str, str], str | None] = {}
    for node in context.system.nodes:
        for port in node.ports:
            name = port.interface
            if is_unresolved(name.value) or context.interfaces.find(name.value) is not None:
                continue
            problem = context.interfaces.problem(name.value)
            if problem is not None:
                yield _invalid(context, port, problem)
                continue
            key = (name.value, port.kind.channel.interface_folder)
            if key not in hints:
                hints[key] = _hint(context, port)
            yield Diagnostic(
                RULE,
                f"there is no {_word(port)} type '{name}'",
                name.span,
                hint=hints[key],
            )


def _invalid(context: Context, port: Port, problem: InvalidDefinition) -> Diagnostic:
    """Report an error in a definition: in its file, if that is one of the project."""
    used = port.interface.span
    if context.interfaces.source_folder(problem.name) is None or not problem.path:
        return Diagnostic(RULE, str(problem), used, hint=f"see {shown(problem.place, limit=300)}")
    label = Label(used, f"'{port.name}' has this type")
    return Diagnostic(RULE, str(problem), problem.span, (label,), problem.hint)


def invalid_definitions(interfaces: Interfaces, packages: Collection[str]) -> Iterator[Diagnostic]:
    """Check all definitions of some packages of a project, whether a system uses them or not."""
    for folder in FOLDERS:
        for name in interfaces.names(folder):
            if name.partition("/")[0] in packages and interfaces.find(name) is None:
                problem = interfaces.problem(name)
                if problem is not None:
                    yield Diagnostic(RULE, str(problem), problem.span, hint=problem.hint)


def _word(port: Port) -> str:
    return {"msg": "message"}.get(port.kind.channel.interface_folder, port.kind.channel.value)


def _hint(context: Context, port: Port) -> str | None:
    folder = port.kind.channel.interface_folder
    name = port.interface.value
    package, slash, rest = name.partition("/")
    known = context.interfaces.names(folder)
    full = f"{package}/{folder}/{rest.rpartition('/')[2]}"
    if full in known:
        return f"write '{full}'"
    incomplete = context.interfaces.folder_without_manifest(package)
    if incomplete is not None:
        return f"'{shown_path(incomplete)}' has no package.xml: add one that names '{package}'"
    hint = similar_interface(full if slash else name, known)
    if not slash:
        return hint or f"include the package, as in std_msgs/{folder}/Name"
    packages = context.interfaces.packages()
    if hint is not None and (package in packages or nearest(package, packages) is not None):
        return hint
    source = "or put its source into the folder 'interfaces'"
    install = f"install the package '{shown(package)}', {source}"
    return install if hint is None else f"{install}; {hint}"
