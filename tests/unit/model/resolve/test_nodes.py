from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.source import SourceFile
from composer.language.document import parse_document
from composer.model import Event, PortKind
from composer.model.resolve import resolve
from composer.project import Project
from composer.project.node_types import NodeTypes
from tests.unit.support.resolving import quoted, resolve_text, system_of

CAMERA = """\
node: camera
description: Takes pictures.
behavior: camera:Camera
variables: {message_type: {default: std_msgs/msg/String}}
parameters:
  rate_hz: {type: double, default: 10.0}
publishers:
  image: {type: "${message_type}", qos: sensor_data}
timers:
  shoot: {period_ms: 100, log: click}
state: {count_of_pictures: 0}
on_activate: {log: ready}
"""


@pytest.fixture
def nodes(tmp_path: Path) -> Path:
    (tmp_path / "camera.yaml").write_text(CAMERA)
    return tmp_path


def test_namespaces_are_below_the_systems_or_the_command_lines_unless_absolute() -> None:
    text = """\
        system: robot
        namespace: robot1
        nodes: {plain: {}, deep: {namespace: arm/left}, away: {namespace: /world}}
        """
    for option, above in ((None, "robot1"), ("robot2", "robot2")):
        nodes = system_of(text, namespace=option).nodes
        full_names = [node.full_name for node in nodes]
        assert full_names == [f"/{above}/plain", f"/{above}/arm/left/deep", "/world/away"]
        assert quoted(nodes[1].namespace.span) == "arm/left"
    span = nodes[0].namespace.span
    assert (span.file.path, quoted(span)) == ("--namespace", "robot2")


def test_a_type_gives_a_node_what_it_is_made_of_and_the_node_refines_it(nodes: Path) -> None:
    system = system_of(
        """\
        system: robot
        nodes:
          front: {type: camera, namespace: perception}
          rear:
            type: camera
            publishers: {image: {qos: state, required: false}}
            timers: {shoot: {rate_hz: 5}}
            state: {count_of_pictures: 7}
            on_activate: {log: steady}
        """,
        nodes,
    )
    front, rear = system.nodes
    assert (str(front.type_name), front.type_found, front.complete) == ("camera", True, True)
    assert front.description == "Takes pictures."
    assert (front.behavior.module, front.behavior.class_name) == ("camera", "Camera")
    assert front.behavior.folder == nodes
    image = front.port("image")
    assert (image.kind, image.full_name) == (PortKind.PUBLISHER, "/perception/image")
    assert image.span.file.path.endswith("camera.yaml")
    assert [timer.name.value for timer in front.timers] == ["shoot"]
    assert [(name.value, value) for name, value in front.state] == [("count_of_pictures", 0)]
    assert [event for event, _ in front.reactions] == [Event.ACTIVATE]
    image = rear.ports[0]
    assert (str(image.interface), image.qos.profile.depth) == ("std_msgs/msg/String", 1)
    assert (image.required, image.span.file.path) == (False, "robot.yaml")
    timer = rear.timers[0]
    assert (timer.period.value, timer.period.unit) == (5, "rate_hz")
    assert timer.reaction is not None
    assert [value for _, value in rear.state] == [7]
    assert dict(rear.reactions)[Event.ACTIVATE].span.file.path == "robot.yaml"


def test_a_type_file_with_errors_reports_them_once_and_is_incomplete(nodes: Path) -> None:
    (nodes / "broken.yaml").write_text("node: broken\nservices: [\n")
    (nodes / "system.yaml").write_text("system: robot\n")
    (nodes / "wrong.yaml").write_text(
        "node: wrong\nvariables: {text: {default: a}}\ndescription: ${text}\n"
        "timers: {tick: {period_ms: 5, when: 1 +}}\n"
        "publishers: {out: {type: std_msgs/msg/String}}\n"
    )
    system, diagnostics = resolve_text(
        """\
        system: robot
        nodes:
          one: {type: broken}
          two: {type: broken}
          three: {type: system}
          four: {type: wrong}
          five: {type: wrong, variables: {text: b}}
          six: {type: wrong, publishers: {out: {qos: state}}}
        """,
        nodes,
    )
    assert [(node.type_found, node.complete) for node in system.nodes[:3]] == [(True, False)] * 3
    assert [(Path(item.primary.file.path).name, item.rule.name) for item in diagnostics] == [
        ("broken.yaml", "yaml-syntax"),
        ("system.yaml", "wrong-kind-of-file"),
        ("wrong.yaml", "invalid-expression"),
    ]
    assert "is a system, not a node type" in diagnostics[1].message


def test_a_variable_without_value_makes_nothing_wrong() -> None:
    system = system_of("""\
        node: relay
        variables: {kind: {}, condition: {}, rate: {}}
        subscriptions:
          input:
            type: ${kind}
            topic: /${kind}/in
            qos: ${kind}
            when: "${condition} > {"
            log: "${kind} {"
        timers: {tick: {rate_hz: "${rate}"}}
        """)
    (relay,) = system.nodes
    assert relay.ports[0].full_name == "/${kind}/in"
    assert system.qos_references == ()
    assert len(relay.timers) == 1


def test_a_file_of_no_kind_has_a_diagnostic(tmp_path: Path) -> None:
    source = SourceFile("compose.yaml", "nodes: {}\n")
    tree, _ = parse_document(source)
    assert tree is not None
    system, (diagnostic,) = resolve(tree, source, NodeTypes.of(Project.at(tmp_path)))
    assert system is None
    assert diagnostic.message == "'compose.yaml' is not a system, a node type or a scenario"
    assert quoted(diagnostic.primary) == "nodes"


def test_a_variable_without_default_must_be_given(tmp_path: Path) -> None:
    (tmp_path / "relay.yaml").write_text(
        "node: relay\nvariables: {kind: {}}\nsubscriptions: {in: {type: '${kind}'}}\n"
    )
    system, diagnostics = resolve_text(
        """\
        system: robot
        nodes:
          good: {type: relay, variables: {kind: x/msg/X}}
          bad: {type: relay}
          worse: {type: relay}
        """,
        tmp_path,
    )
    found = [(diagnostic.rule.name, diagnostic.primary.line) for diagnostic in diagnostics]
    assert found == [("missing-variable", 4), ("missing-variable", 5)]
    assert diagnostics[0].message == "node type 'relay' needs a value for its variable 'kind'"
    assert quoted(diagnostics[0].primary) == "relay"
    assert quoted(diagnostics[0].related[0].span) == "kind"
    types = [node.ports[0].interface.value for node in system.nodes]
    assert types == ["x/msg/X", "${kind}", "${kind}"]


def test_a_mistake_in_an_argument_is_reported_at_every_argument(tmp_path: Path) -> None:
    (tmp_path / "filter.yaml").write_text(
        "node: filter\nvariables: {condition: {}, count: {}}\n"
        "subscriptions: {in: {type: x/msg/X, when: '${condition}', required: '${count}'}}\n"
    )
    variables = ["{condition: 1 +, count: true}"] * 2 + ["{condition: count > 1, count: [1]}"] * 2
    nodes = [f"  n{i}: {{type: filter, variables: {item}}}\n" for i, item in enumerate(variables)]
    _, diagnostics = resolve_text(f"system: robot\nnodes:\n{''.join(nodes)}", tmp_path)
    assert [diagnostic.primary.line for diagnostic in diagnostics] == [3, 4, 5, 6]
    assert {diagnostic.primary.file.path for diagnostic in diagnostics} == {"robot.yaml"}


def test_a_node_may_have_another_name_in_ros(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(
        "/front/camera: {ros__parameters: {rate_hz: 5.0}}\n"
        "/front_camera: {ros__parameters: {rate_hz: 1.0}}\n"
    )
    system, diagnostics = resolve_text(
        """\
        system: robot
        parameter_files: [robot.yaml]
        nodes:
          front_camera:
            name: camera
            namespace: front
            parameters: {rate_hz: {type: double, default: 2.0}}
            publishers:
              image: {type: sensor_msgs/msg/Image, topic: ~/image}
              info: {type: sensor_msgs/msg/CameraInfo}
          viewer:
            lifecycle: {depends_on: [front_camera]}
            subscriptions: {image: {type: sensor_msgs/msg/Image}}
        connections:
          - {topic: /image, from: front_camera.image, to: viewer.image}
          - {topic: /info, from: front_camera.info}
        """,
        tmp_path,
    )
    assert diagnostics == []
    camera, _ = system.nodes
    assert camera.name.value == "front_camera"
    assert camera.full_name == "/front/camera"
    assert camera.ros_name.span.line == 5
    assert [port.full_name for port in camera.ports] == ["/image", "/info"]
    assert camera.initial_parameters == {"rate_hz": 5.0}
    (unmatched,) = system.unmatched_parameters
    assert unmatched.section.value == "/front_camera"
