"""QoS overrides: what a parameter of a node changes, what it cannot, and where that is reported."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load_bytes
from tests.unit.support.checking import diagnostics_in, diagnostics_of_each, quoted

NODES = """\
system: words
{above}nodes:
  talker:
    parameters: {{{talker}}}
    publishers: {{words: {{type: std_msgs/msg/String, qos: command}}}}
    timers: {{tick: {{rate_hz: 1, publish: {{words: {{}}}}}}}}
  listener:
    parameters: {{{listener}}}
    subscriptions: {{words: {{type: std_msgs/msg/String, qos: command, log: "{{message.data}}"}}}}
"""
PUBLISHER, SUBSCRIPTION = "qos_overrides./words.publisher", "qos_overrides./words.subscription"


def words(talker: str = "", listener: str = "", above: str = "") -> str:
    return NODES.format(talker=talker, listener=listener, above=above)


def profile(text: str, node: str, folder: Path) -> dict[str, object]:
    changed = load_bytes(text.encode(), folder, shown="system.yaml").system.node(node).ports[0].qos
    return {name: getattr(changed.profile, name) for name in changed.overridden}


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("depth: 3", {"depth": 3}),
        ("depth: 0", {"depth": 0}),
        ("history: keep_all", {"history": "keep_all"}),
        ("reliability: BEST_EFFORT", {"reliability": "best_effort"}),
        ("durability: transient_local", {"durability": "transient_local"}),
        ("deadline: 2500000", {"deadline_ms": 2.5}),
        ("deadline: 9223372036854775807", {"deadline_ms": None}),
        ("lifespan: 1000000000", {"lifespan_ms": 1000.0}),
        ("lifespan: 0", {"lifespan_ms": None}),
        ("liveliness: manual_by_topic", {"liveliness": "manual_by_topic"}),
        ("liveliness_lease_duration: 1000000", {"liveliness_lease_duration_ms": 1.0}),
    ],
)
def test_policies(given: str, expected: dict[str, object], tmp_path: Path) -> None:
    policy, _, value = given.partition(": ")
    (tmp_path / "all.yaml").write_text(
        f"/**: {{ros__parameters: {{qos_overrides: {{/words: {{publisher: {{{given}}}}}}}}}}}\n"
    )
    by_key = words(f"{PUBLISHER}.{policy}: {value}")
    by_file = words(above="parameter_files: [all.yaml]\n")
    for text in (by_key, by_file):
        assert profile(text, "talker", tmp_path) == expected
        assert profile(text, "listener", tmp_path) == {}


def cannot_be_overridden(policy: str, end: str) -> str:
    return f"the policy '{policy}' of a {end} cannot be overridden"


POLICIES = "valid here: deadline, depth, durability, history, "
LAST_POLICIES = "liveliness, liveliness_lease_duration, reliability"
#: Parameters of the talker or, with a subscription, of the listener; the message and the hint; the
#: value is marked if the name is right.
MISTAKES = [
    ("qos_overrides./wrods.publisher.depth: 1",
     "node 'talker' has no topic '/wrods'", "did you mean '/words'?"),
    ("qos_overrides.words.publisher.depth: 1",
     "node 'talker' has no topic 'words'", "did you mean '/words'?"),
    (f"{PUBLISHER}.realiability: best_effort",
     cannot_be_overridden("realiability", "publisher"), "did you mean 'reliability'?"),
    (f"{PUBLISHER}.avoid_ros_namespace_conventions: true",
     cannot_be_overridden("avoid_ros_namespace_conventions", "publisher"),
     f"{POLICIES}lifespan, {LAST_POLICIES}"),
    (f"{SUBSCRIPTION}.lifespan: 1000000",
     cannot_be_overridden("lifespan", "subscription"), POLICIES + LAST_POLICIES),
    (f"{PUBLISHER}.history: !keep_lost",
     f"parameter '{PUBLISHER}.history' cannot be the string 'keep_lost'",
     "did you mean 'keep_last'?"),
    (f"{PUBLISHER}.depth: !'3'",
     f"parameter '{PUBLISHER}.depth' must be of type integer, not the string '3'", None),
    (f"{PUBLISHER}.deadline: !-1",
     f"parameter '{PUBLISHER}.deadline': -1 is less than the minimum of 0", None),
    (f"{PUBLISHER}.reliability: !best_effort",
     "publisher 'talker.words' offers reliability best_effort on '/words', "
     "but subscription 'listener.words' requests reliable",
     "offer reliable, or request best_effort"),
    (f"{SUBSCRIPTION}.durability: !transient_local",
     "subscription 'listener.words' requests durability transient_local on '/words', "
     "but publisher 'talker.words' offers volatile",
     "offer transient_local, or request volatile"),
]  # fmt: skip


@pytest.mark.parametrize(("given", "message", "hint"), MISTAKES)
def test_mistakes(given: str, message: str, hint: str | None, tmp_path: Path) -> None:
    name, value = given.split(": ")
    node = "listener" if name.startswith(SUBSCRIPTION) else "talker"
    (found,) = diagnostics_in(words(**{node: given.replace("!", "")}), tmp_path)
    marked = value[1:] if value.startswith("!") else name
    assert (quoted(found), found.message, found.hint) == (marked, message, hint)


def test_a_node_has_no_such_end(tmp_path: Path) -> None:
    (found,) = diagnostics_in(words(f"{SUBSCRIPTION}.depth: 1"), tmp_path)
    assert quoted(found) == f"{SUBSCRIPTION}.depth"
    assert found.message == "node 'talker' has no subscription on '/words'"
    assert found.hint == "valid here: publisher"


def test_an_override_takes_precedence_over_a_connection(tmp_path: Path) -> None:
    connection = "{topic: /words, from: talker.words, to: listener.words, qos: command}"
    text = words(f"{PUBLISHER}.depth: 4", above=f"connections: [{connection}]\n")
    assert profile(text, "talker", tmp_path) == {"depth": 4}
    assert diagnostics_in(text, tmp_path) == []


def test_a_topic_that_no_node_has_is_reported_for_wildcards(tmp_path: Path) -> None:
    values = "qos_overrides: {/wrods: {publisher: {depth: 3}}, /clock: {subscription: {depth: 1}}}"
    (tmp_path / "all.yaml").write_text(f"/**: {{ros__parameters: {{{values}}}}}\n")
    (found,) = diagnostics_in(words(above="parameter_files: [all.yaml]\n"), tmp_path)
    assert found.hint == f"did you mean '{PUBLISHER}.depth'?"


CLASS = """\
from rclpy.node import Node
from rclpy.qos import QoSPolicyKind
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_msgs.msg import String

KINDS = list(QoSPolicyKind)

class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.words = self.create_publisher(String, "words", 10{options})
"""


OPTS_IN = ", qos_overriding_options=QoSOverridingOptions.with_default_policies()"
DURABILITY = ", qos_overriding_options=QoSOverridingOptions([QoSPolicyKind.DURABILITY])"
COMPUTED = ", qos_overriding_options=QoSOverridingOptions(KINDS)"


CREATES = "class 'Talker' creates publisher 'words' with"
#: Options of the publisher of a class, an override, and the diagnostic.
OVERRIDDEN = [
    ("", "depth: 3", f"{CREATES} depth 10, not 3"),
    (OPTS_IN, "depth: 3", None),
    (DURABILITY, "durability: transient_local", None),
    (DURABILITY, "depth: 3", f"{CREATES} depth 10, not 3"),
    (COMPUTED, "depth: 3", None),
    (OPTS_IN, "deadline: 1000000", f"{CREATES} deadline_ms unlimited, not 1.0"),
    ("", "reliability: best_effort", f"{CREATES} reliability reliable, not best_effort"),
    (
        OPTS_IN,
        "reliability: best_effort",
        "publisher 'talker.words' offers reliability best_effort on '/words', "
        "but subscription 'listener.words' requests reliable",
    ),
]


def test_a_class_decides_whether_parameters_override_its_qos(tmp_path: Path) -> None:
    system = words(f"{PUBLISHER}.%s, qos_overrides./other.publisher_id.depth: 2")
    system = system.replace("  talker:\n", '  talker:\n    class: "talker:Talker"\n')
    system = system.replace("    timers: {tick: {rate_hz: 1, publish: {words: {}}}}\n", "")
    projects = [
        {"system.yaml": system.replace("%s", given), "talker.py": CLASS.format(options=options)}
        for options, given, _ in OVERRIDDEN
    ]
    for case, found in zip(OVERRIDDEN, diagnostics_of_each(projects, tmp_path), strict=True):
        assert [item.message for item in found] == [case[2]][: case[2] is not None], case
