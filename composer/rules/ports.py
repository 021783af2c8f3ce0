"""The kinds and interfaces of ports."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from composer.base.diagnostics import Diagnostic, Label, error, nearest, shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import shown_path
from composer.interfaces import Interfaces, InvalidDefinition
from composer.interfaces.index import similar_interface
from composer.model import Chain, ChannelKind, Connection, Endpoint, Port, PortKind
from composer.model.interface_packages import how_to_build
from composer.rules.analysis.context import KINDS_OF_INTERFACES, Context, is_unresolved
from composer.rules.analysis.expressions import SENDERS, sends
from composer.rules.analysis.formatting import a, either
from composer.rules.analysis.subjects import connection_subjects, package_subjects, port_subject

UNKNOWN_INTERFACE = error("RC301", "unknown-interface")
OUTDATED_INTERFACE = error("RC307", "outdated-interface")
WRONG_PORT_KIND = error("RC211", "wrong-port-kind")


def check_unknown_interface(context: Context) -> Iterator[Diagnostic]:
    """Look up the type of every port."""
    hints: dict[tuple[str, str], str | None] = {}
    for node in context.system.nodes:
        for port in node.ports:
            name = port.interface
            if is_unresolved(name.value) or context.interfaces.find(name.value) is not None:
                continue
            problem = context.interfaces.problem(name.value)
            if problem is not None:
                yield _invalid_definition(context, port, problem)
                continue
            key = (name.value, port.kind.channel.interface_folder)
            if key not in hints:
                hints[key] = _interface_hint(context, port)
            yield Diagnostic(
                UNKNOWN_INTERFACE,
                f"there is no {_type_word(port.kind.channel)} type '{name}'",
                name.span,
                hint=hints[key],
                subjects=package_subjects(context.interfaces, name.value),
                relies_on=(("folder", "interfaces"),),
            )


def _invalid_definition(context: Context, port: Port, problem: InvalidDefinition) -> Diagnostic:
    """Report an error in a definition: in its file, if that is one of the project."""
    used = port.interface.span
    if context.interfaces.source_folder(problem.name) is None or not problem.path:
        return Diagnostic(
            UNKNOWN_INTERFACE, str(problem), used, hint=f"see {shown(problem.place, limit=300)}"
        )
    label = Label(used, f"'{port.name}' has this type")
    return Diagnostic(UNKNOWN_INTERFACE, str(problem), problem.span, (label,), problem.hint)


def invalid_definitions(interfaces: Interfaces, packages: Collection[str]) -> Iterator[Diagnostic]:
    """Check all definitions of some packages of a project, whether a system uses them or not."""
    for name in interfaces.names():
        if name.partition("/")[0] in packages and interfaces.find(name) is None:
            problem = interfaces.problem(name)
            if problem is not None:
                yield Diagnostic(UNKNOWN_INTERFACE, str(problem), problem.span, hint=problem.hint)


def _type_word(kind: ChannelKind) -> str:
    return "message" if kind is ChannelKind.TOPIC else kind.value


def _interface_hint(context: Context, port: Port) -> str | None:
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


def check_wrong_interface_kind(context: Context) -> Iterator[Diagnostic]:
    """Check the kind of every port's type."""
    for node in context.system.nodes:
        for port in node.ports:
            found = context.interfaces.find(port.interface.value)
            kind = port.kind.channel
            actual = kind if found is None else KINDS_OF_INTERFACES[type(found)]
            if actual is kind:
                continue
            yield Diagnostic(
                UNKNOWN_INTERFACE,
                f"'{port.interface}' is {a(_type_word(actual))} type, "
                f"but {a(port.kind)} needs {a(_type_word(kind))} type",
                port.interface.span,
            )


def check_outdated_interface(context: Context) -> Iterator[Diagnostic]:
    """Compare the project's definitions of all port types with the installed ones, if any."""
    checked: set[str] = set()
    reported: set[str] = set()
    for node in context.system.nodes:
        for port in node.ports:
            name = port.interface
            if name.value in checked or is_unresolved(name.value):
                continue
            checked.add(name.value)
            outdated = context.interfaces.outdated(name.value)
            if outdated is None or outdated in reported:
                continue
            reported.add(outdated)
            package = outdated.partition("/")[0]
            yield Diagnostic(
                OUTDATED_INTERFACE,
                f"'{outdated}' has changed since the package '{package}' was built",
                name.span,
                hint=how_to_build(package, context.interfaces.source_folder(outdated)),
            )


def check_wrong_port_kind(context: Context) -> Iterator[Diagnostic]:
    """Check the endpoints of connections and the ports that reactions send through."""
    for connection in context.system.connections:
        yield from _wrong_ports_of_connection(context, connection)
    for chain in context.system.chains:
        yield from _wrong_ports_of_chain(context, chain)
    for site, key, send in sends(context.system):
        port = site.node.port(send.port.value)
        allowed = SENDERS[key]
        if port is not None and port.kind not in allowed:
            yield Diagnostic(
                WRONG_PORT_KIND,
                f"'{key}' needs {either(allowed)}, but '{port.name}' is {a(port.kind)}",
                send.port.span,
                (Label(port.name.span, f"declared as {a(port.kind)}"),),
                _sending_hint(port.kind),
                (port_subject(site.node, port),),
            )


def _wrong_ports_of_chain(context: Context, chain: Chain) -> Iterator[Diagnostic]:
    for endpoint in chain.through:
        port = context.system.port(endpoint)
        if port is not None and port.kind is not PortKind.PUBLISHER:
            yield Diagnostic(
                WRONG_PORT_KIND,
                f"chain '{chain.name}' consists of publishers, but '{endpoint.text}' "
                f"is {a(port.kind)}",
                endpoint.text.span,
                (Label(port.name.span, f"declared as {a(port.kind)}"),),
            )


@dataclass(frozen=True, slots=True)
class _Slot:
    """An endpoint of a connection: its key, the kind of port it requires, and the actual port."""

    endpoint: Endpoint
    key: str
    expected: PortKind
    port: Port

    @property
    def label(self) -> Label:
        return Label(self.port.name.span, f"'{self.endpoint.text}' is {a(self.port.kind)}")


def _wrong_ports_of_connection(context: Context, connection: Connection) -> Iterator[Diagnostic]:
    slots = list(_slots(context, connection))
    wrong = [slot for slot in slots if slot.port.kind is not slot.expected]
    kinds = {slot.port.kind.channel for slot in wrong}
    if len(wrong) > 1 and len(wrong) == len(slots) and len(kinds) == 1:
        yield _all_wrong(context, connection, wrong, kinds.pop())
        return
    for slot in wrong:
        actual = slot.port.kind
        yield Diagnostic(
            WRONG_PORT_KIND,
            f"'{slot.key}' of {connection.kind} '{connection.name}' needs {a(slot.expected)}, "
            f"but '{slot.endpoint.text}' is {a(actual)}",
            slot.endpoint.text.span,
            (Label(slot.port.name.span, f"declared as {a(actual)}"),),
            _belongs(connection, actual),
            (("port", slot.endpoint.text.value), *connection_subjects(context.system, connection)),
        )


def _slots(context: Context, connection: Connection) -> Iterator[_Slot]:
    groups = (connection.sources, connection.sinks)
    kind = connection.kind
    for endpoints, key, expected in zip(groups, kind.keys_of_ends, kind.ends, strict=True):
        for endpoint in endpoints:
            port = context.system.port(endpoint)
            if port is not None:
                yield _Slot(endpoint, key, expected, port)


def _all_wrong(
    context: Context, connection: Connection, slots: list[_Slot], kind: ChannelKind
) -> Diagnostic:
    """Report one diagnostic for a connection whose endpoints are all wrong."""
    source_key, sink_key = connection.kind.keys_of_ends
    if kind is connection.kind:
        message = f"the endpoints of {kind} '{connection.name}' are swapped"
        hint = f"swap '{source_key}' and '{sink_key}'"
    else:
        message = (
            f"'{connection.name}' connects the endpoints of {a(kind)}, not of {a(connection.kind)}"
        )
        source_key, sink_key = kind.keys_of_ends
        hint = f"write '{kind}:', '{source_key}:' and '{sink_key}:'"
    labels = tuple(slot.label for slot in slots)
    subjects = connection_subjects(context.system, connection)
    return Diagnostic(WRONG_PORT_KIND, message, connection.span, labels, hint, subjects)


def _belongs(connection: Connection, actual: PortKind) -> str:
    if actual.channel is connection.kind:
        other = connection.kind.keys_of_ends[0 if actual.is_source else 1]
        return f"{a(actual)} belongs under '{other}'"
    return f"{a(actual)} belongs in a connection that starts with '{actual.channel}:'"


def _sending_hint(kind: PortKind) -> str | None:
    if kind is PortKind.PUBLISHER:
        return "use 'publish' to send a message"
    if kind in {PortKind.CLIENT, PortKind.ACTION_CLIENT}:
        return "use 'call' to send a request or a goal"
    return None
