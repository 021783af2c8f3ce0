"""Any tree can be resolved and planned without exceptions."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from composer.language.tree import Entry, Mapping, Scalar
from composer.model.dependencies import dependency_cycles
from composer.model.resolve import OverrideOptions, read_overrides, resolve
from composer.plan import bring_up, tear_down
from composer.project import Project
from composer.project.node_types import NodeTypes
from tests.examples import examples
from tests.properties.mutation import SOURCE, SPAN, maps, trees

FOLDER = Path("/nowhere")

KEYS = [
    *("system", "node", "type", "namespace", "nodes", "connections", "qos_profiles", "executors"),
    *("lifecycle", "autostart", "depends_on", "parameters", "remappings", "publishers"),
    *("subscriptions", "services", "clients", "action_servers", "action_clients", "timers"),
    *("state", "qos", "extends", "depth", "reliability", "deadline_ms", "topic", "service"),
    *("action", "from", "to", "server", "period_ms", "rate_hz", "when", "set", "log", "publish"),
    *("call", "respond", "accept", "feedback", "result", "count", "message", "on_response"),
    *("on_activate", "default", "minimum", "choices", "kind", "threads", "a", "b", "relay"),
]
TEXTS = [
    "a", "b", "a.b", "relay", "sensor_data", "active", "inactive", "", ".", "~", "/", "//", "~x",
    "${x}", "{x}", "{", "}", "{{", "{count:.2f}", "message.data", "1 +", "double", "\x00", "ü" * 50,
]  # fmt: skip

numbers = st.integers(-(2**63), 2**64) | st.floats(allow_nan=False, allow_infinity=False)
scalars = st.one_of(st.none(), st.booleans(), numbers, st.sampled_from(TEXTS), st.text(max_size=8))


KEY = st.sampled_from(KEYS)
VALUES = trees(KEY, scalars, 4, 25)


@st.composite
def files(draw: st.DrawFn) -> Mapping:
    """Draw a file whose first key makes it a system or a node type, with random content."""
    first = Entry(
        Scalar(draw(st.sampled_from(["system", "node"])), SPAN), Scalar(draw(scalars), SPAN)
    )
    nodes = Entry(Scalar("nodes", SPAN), draw(maps(KEY, maps(KEY, VALUES, 6), 6)))
    rest = draw(maps(KEY, VALUES, 6))
    kept = [entry for entry in rest if entry.name not in {"system", "node", "nodes"}]
    return Mapping((first, nodes, *kept), SPAN)


@examples(120)
@given(tree=files(), text=st.sampled_from(TEXTS) | st.text(max_size=12))
def test_every_tree_has_a_model_and_a_plan(tree: Mapping, text: str) -> None:
    overrides, _ = read_overrides(OverrideOptions((f"a.b={text}", text), text))
    system, _ = resolve(
        tree,
        SOURCE,
        NodeTypes((FOLDER,), Project.at(FOLDER)),
        folders={SOURCE.path: FOLDER},
        overrides=overrides,
    )
    assert system is not None
    assert dependency_cycles(system) is not None
    assert len(tear_down(system).steps) == 3 * len(system.nodes)
    assert len(bring_up(system).steps) <= 2 * len(system.nodes)
