"""What editors with yaml-language-server, such as VS Code, offer and show for our files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from composer.base.folders import nodes_folder, schemas_folder, systems_folder
from composer.language.document import read_document
from composer.language.tree import Entry, Mapping, Sequence, Tree
from tests.language_server.client import Cursor, LanguageServer
from tests.programs import require_package

HERE = Path(__file__).parent
SERVER = HERE / "node_modules/yaml-language-server/bin/yaml-language-server"
SYSTEM = schemas_folder() / "system.schema.json"
NODE = schemas_folder() / "node.schema.json"

NODE_OF = "system: s\nnodes:\n  n:\n    "
PARAMETER_TYPES = (
    "bool integer double string byte_array bool_array integer_array double_array string_array"
)
ARGUMENT_TYPES = "bool integer double string bool_array integer_array double_array string_array"
WORDS = [
    ("system: s\nqos_profiles:\n  q:\n    reliability: |", "reliable best_effort"),
    ("system: s\nqos_profiles:\n  q:\n    durability: |", "volatile transient_local"),
    ("system: s\nqos_profiles:\n  q:\n    history: |", "keep_last keep_all"),
    ("system: s\nqos_profiles:\n  q:\n    liveliness: |", "automatic manual_by_topic"),
    ("system: s\nexecutors:\n  e:\n    kind: |", "events single_threaded multi_threaded"),
    ("system: s\nexecutors:\n  e:\n    kind: mul|", "events single_threaded multi_threaded"),
    ("system: s\ndelivery: |", "auto dds"),
    ("system: s\ndiscovery:\n  kind: |", "multicast server peers"),
    (NODE_OF + "executable:\n      kind: |", "node task"),
    (NODE_OF + "executable:\n      lifecycle: |", "managed none"),
    (NODE_OF + "external:\n      lifecycle: |", "managed none"),
    (NODE_OF + "log_level: |", "debug info warn error fatal"),
    ("system: s\nlifecycle:\n  on_failure: |", "restart isolate shutdown ignore"),
    ("system: s\nconnections:\n  - topic: t\n    isolation: |", "share copy"),
    (NODE_OF + "lifecycle:\n      autostart: |", "active inactive unconfigured"),
    (NODE_OF + "lifecycle:\n      depends_on:\n        m: |", "active inactive"),
    (NODE_OF + "parameters:\n      p:\n        type: |", PARAMETER_TYPES),
    ("system: s\narguments:\n  a:\n    type: |", ARGUMENT_TYPES),
    (NODE_OF + "timers:\n      t:\n        clock: |", "ros steady"),
    (
        NODE_OF + "timers:\n      t:\n        log:\n          level: |",
        "debug info warn error fatal",
    ),
    (NODE_OF + "publishers:\n      p:\n        external: |", "true false"),
]
CONNECTIONS = "connections:\n  "
ENDS = "from to server clients"
#: Maps whose values have keys of the user.
FREE = frozenset(
    {"arguments", "variables", "state", "publish", "call", "respond", "set", "feedback", "result"}
)


@pytest.fixture(scope="module")
def server() -> Iterator[LanguageServer]:
    require_package(HERE, "yaml-language-server")
    server = LanguageServer(SERVER)
    try:
        yield server
    finally:
        server.close()


def test_the_words_of_a_value_are_offered(server: LanguageServer) -> None:
    offered = {text: server.complete(server.open(f"{text}\n", SYSTEM)) for text, _ in WORDS}
    assert {text: set(words) for text, words in offered.items()} == {
        text: set(words.split()) for text, words in WORDS
    }
    cursor = server.open("node: n\nparameters:\n  p:\n    type: |\n", NODE)
    assert set(server.complete(cursor)) == set(PARAMETER_TYPES.split())


@pytest.mark.parametrize(
    ("text", "offered", "not_offered"),
    [
        ("arguments:\n  a:\n    |", "type default choices description", ""),
        ("nodes:\n  n:\n    |", "for_each if unless", ""),
        ("processes:\n  p:\n    |", "for_each if unless", ""),
        ("include:\n  - file: a.yaml\n    |", "for_each if unless arguments", ""),
        ("connections:\n  - topic: a\n    |", "for_each if unless", ""),
        (f"{CONNECTIONS}- |", f"topic service action {ENDS}", ""),
        (f"{CONNECTIONS}- t|", f"topic service action {ENDS}", ""),
        (f"{CONNECTIONS}- {{topic: a, from: n.a}}\n  - |", f"topic service action {ENDS}", ""),
        (f"{CONNECTIONS}- from: n.a\n    |", "topic to", "from"),
        (f"{CONNECTIONS}- topic: a\n    |", "from to qos", "topic service action server clients"),
        (f"{CONNECTIONS}- service: a\n    |", "server clients qos", "topic service action from to"),
        (f"{CONNECTIONS}- action: a\n    |", "server clients qos", "topic service action from to"),
    ],
)
def test_keys_are_offered_with_their_documentation(
    server: LanguageServer, text: str, offered: str, not_offered: str
) -> None:
    found = server.complete(server.open(f"system: s\n{text}\n", SYSTEM))
    assert set(offered.split()) <= found.keys()
    assert not set(not_offered.split()) & found.keys()
    assert [key for key, documentation in found.items() if not documentation] == []


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("system: s\nqos_profiles: {q: {rel|iability: reliable}}", "lost messages are sent again"),
        ("system: s\nqos_profiles: {q: {dead|line_ms: 5}}", "Maximum time between two messages"),
        ("system: s\nexecutors: {e: {ki|nd: events}}", "How many callbacks run"),
        ("system: s\nexecutors: {e|e: {kind: events}}", "calls the callbacks of its nodes"),
        ("system: s\nlifecycle: {on_f|ailure: isolate}", "What to do when a node fails"),
        ("system: s\nconnections: [{fr|om: n.a}]", "The publisher or publishers"),
        ("system: s\nconnections: [{topic: a, fr|om: n.a}]", "The publisher or publishers"),
        ("system: s\nconnections: [{service: a, ser|ver: n.a}]", "The service server"),
        ("system: s\nconnections: [{action: a, ser|ver: n.a}]", "The action server"),
        ("system: s\nparameter|_files: [a.yaml]", "ROS parameter files"),
        ("system: s\nargu|ments: {a: 1}", "Named values that"),
        ("system: s\narguments: {a: {cho|ices: [x]}}", "The allowed values"),
        (NODE_OF + "{i|f: sim}", "Leave this out unless the condition holds"),
        ("system: s\ninclude: [{file: a.yaml, un|less: sim}]", "Leave this out if the condition"),
        (NODE_OF + "parameters: {p: {ty|pe: double}}", "The ROS parameter type"),
        (NODE_OF + "parameters: {p|p: 1.0}", "A parameter, declared by"),
        (NODE_OF + "{type: relay, parameters: {p|p: 1.0}}", "The value of a parameter"),
        (NODE_OF + "{type: relay, remappings: {p|p: q}}", "The ROS name to use instead"),
        (NODE_OF + "lifecycle: {auto|start: active}", "The target lifecycle state"),
        ("system: s\nprocesses: {p: {mem|ory_mb: 5}}", "Maximum size of its memory"),
        ("system: s\nprocesses: {p|p: {cpus: [1]}}", "A process with some of the nodes"),
        ("system: s\nhosts: {h: {work|space: ~/a}}", "The folder of the project there"),
        ("system: s\nhosts: {h|h: {user: a}}", "A computer that runs processes"),
        ("system: s\ndiscovery: {ki|nd: server}", "through a discovery server of Fast DDS"),
        (NODE_OF + "cla|ss: a:B", "An existing rclpy class"),
        (NODE_OF + "executable: {pack|age: a}", "The ROS or Python package"),
        (NODE_OF + "external: {ready|_timeout_ms: 5}", "How long the start may take"),
        (NODE_OF + "transforms: {look|up: [map]}", "The frames that the node looks up"),
        (NODE_OF + "transforms: {static: {l: {par|ent: b}}}", "The parent frame"),
        (NODE_OF + "transforms: {static: {l|l: {parent: b}}}", "The pose of a child frame"),
        (NODE_OF + "transforms: {dynamic: {l: {fr|om: b}}}", "The subscription of the node"),
    ],
)
def test_a_key_is_described(server: LanguageServer, text: str, shown: str) -> None:
    found = server.hover(server.open(f"{text}\n", SYSTEM))
    assert shown in found
    assert "A variable." not in found


@pytest.mark.parametrize(
    ("path", "schema"),
    [
        *(
            (systems_folder() / f"{name}.yaml", SYSTEM)
            for name in ("pipeline", "supervised", "fleet", "frames")
        ),
        *((nodes_folder() / f"{name}.yaml", NODE) for name in ("motor_controller", "action_stub")),
    ],
    ids=lambda path: path.stem,
)
def test_shipped_files_are_valid_and_all_their_keys_are_described(
    server: LanguageServer, path: Path, schema: Path
) -> None:
    text = path.read_text(encoding="utf-8").partition("\n")[2]  # the first line names the schema
    tree, _, _ = read_document(path)
    assert tree is not None
    cursor = server.open(text, schema)
    assert server.diagnostics(cursor) == []
    bare = [
        f"{entry.key.span}: {entry.name}"
        for entry in described_entries(tree)
        if "\n" not in server.hover(at(cursor, entry)).strip()  # no more than a title
    ]
    assert bare == []


def at(cursor: Cursor, entry: Entry) -> Cursor:
    """Return a position within the key: its first character ends the value before it."""
    return replace(cursor, line=entry.key.span.line - 1, character=entry.key.span.column)


def described_entries(tree: Tree) -> Iterator[Entry]:
    """Yield the entries of a file, except those whose names the user chooses."""
    if isinstance(tree, Sequence):
        for item in tree.items:
            yield from described_entries(item)
    for entry in tree if isinstance(tree, Mapping) else ():
        yield entry
        if entry.name not in FREE:
            yield from described_entries(entry.value)


def test_a_misspelled_word_is_reported_with_the_valid_ones(server: LanguageServer) -> None:
    text = "system: s\nnodes: {n: {}}\nqos_profiles: {q: {reliability: relaible}}\n"
    (message,) = server.diagnostics(server.open(text, SYSTEM))
    assert '"reliable", "best_effort"' in message
