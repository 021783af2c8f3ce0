"""Systems that include systems: the result, and the places of diagnostics."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic
from composer.loading import load, load_files
from composer.loading.reported import LoadResult, collect_diagnostics
from composer.model import System
from tests.unit.support.checking import load_project, places, write_files

CAMERA = """\
system: camera
arguments: {rate_hz: 10, topic: image}
qos_profiles: {frames: {extends: sensor_data, depth: 2}}
executors: {vision: {kind: single_threaded}}
lifecycle: {on_failure: restart, timeout_ms: 5000}
introspection: {rosout: false}
nodes:
  driver:
    executor: vision
    parameters: {gain: {type: double, default: 1.0, maximum: 4.0}}
    publishers: {image: {type: std_msgs/msg/String, qos: frames}}
    timers: {tick: {rate_hz: "${rate_hz}", publish: {image: {data: "frame {count}"}}}}
  viewer:
    namespace: screen
    lifecycle: {depends_on: [driver], timeout_ms: 100}
    subscriptions: {image: {type: std_msgs/msg/String, qos: frames, log: "{message.data}"}}
connections:
  - {topic: "${topic}", from: driver.image, to: viewer.image}
chains:
  seen: {through: [driver.image, driver.image], latency_ms: 1000}
"""


def included(
    folder: Path, include: str, rest: str = "", files: Mapping[str, str] | None = None
) -> LoadResult:
    whole = f"system: whole\ninclude:\n  - {include}\n{rest}"
    all_files = {"whole.yaml": whole, "camera.yaml": CAMERA, **(files or {})}
    return load_project(folder, all_files, shown="whole.yaml")


def reported(diagnostics: list[Diagnostic]) -> list[str]:
    return [line for line in places(diagnostics) if not line.endswith("impossible-chain")]


def together(*names: str) -> list[str]:
    """Return what is reported about files of the current folder that are checked together."""
    return reported(collect_diagnostics(load_files([Path(name) for name in names])))


def system_of(loading: LoadResult) -> System:
    assert reported(loading.diagnostics) == []
    assert loading.system is not None
    return loading.system


def test_sections_for_all_nodes_apply_to_the_nodes_of_their_file_only(tmp_path: Path) -> None:
    rest = "nodes: {operator: {on_activate: {log: started}}}\n"
    system = system_of(included(tmp_path, "camera.yaml", rest))
    found = {
        node.name.value: (
            node.supervision.timeout_ms,
            str(node.supervision.on_failure),
            node.introspection.rosout,
        )
        for node in system.nodes
    }
    assert found == {
        "driver": (5000, "restart", False),
        "viewer": (100, "restart", False),
        "operator": (10000, "None", True),
    }
    assert system.supervision.on_failure is None


@pytest.mark.parametrize(
    ("include", "whole", "namespace", "topic"),
    [
        ("namespace: left", "", "/left", "/left/image"),
        ("namespace: /left", "namespace: robot\n", "/left", "/left/image"),
        ("namespace: left", "namespace: robot\n", "/robot/left", "/robot/left/image"),
        ("namespace: left, arguments: {topic: /image}", "", "/left", "/image"),
    ],
)
def test_names(tmp_path: Path, include: str, whole: str, namespace: str, topic: str) -> None:
    system = system_of(included(tmp_path, f"{{file: camera.yaml, {include}}}", whole))
    full_names = [node.full_name for node in system.nodes]
    assert full_names == [f"{namespace}/driver", f"{namespace}/screen/viewer"]
    assert {port.full_name for node in system.nodes for port in node.ports} == {topic}


def test_namespaces_of_files_in_files(tmp_path: Path) -> None:
    pair = """\
system: pair
namespace: pair
include:
  - for_each: {side: [left, right]}
    file: ../camera.yaml
    namespace: ${side}
    prefix: ${side}_
nodes:
  referee:
    lifecycle: {depends_on: ["*_viewer"]}
    subscriptions:
      images: {type: std_msgs/msg/String, qos: sensor_data, log: "{message.data}"}
connections:
  - {topic: left/image, to: referee.images}
"""
    include = "{file: parts/pair.yaml, prefix: first_, namespace: /}"
    system = system_of(included(tmp_path, include, files={"parts/pair.yaml": pair}))
    assert [node.full_name for node in system.nodes] == [
        "/pair/left/first_left_driver",
        "/pair/left/screen/first_left_viewer",
        "/pair/right/first_right_driver",
        "/pair/right/screen/first_right_viewer",
        "/pair/first_referee",
    ]
    referee = system.nodes[-1]
    needed = [str(item.node) for item in referee.depends_on]
    assert needed == ["first_left_viewer", "first_right_viewer"]
    assert [port.full_name for port in referee.ports] == ["/pair/left/image"]


def test_overrides(tmp_path: Path) -> None:
    include = """\
file: camera.yaml
    prefix: left_
    overrides:
      nodes:
        driver:
          parameters: {gain: 2.5}
          timers: {tick: {period_ms: 20}}
      qos_profiles: {frames: {depth: 7}}
      executors: {vision: {kind: events}}
"""
    system = system_of(included(tmp_path, include))
    driver = system.nodes[0]
    gain = driver.parameter("gain")
    assert (str(gain.type), gain.default.value) == ("double", 2.5)
    assert str(gain.maximum.span) == "camera.yaml:10:62"
    assert driver.timers[0].period.unit.value == "period_ms"
    assert system.qos_profiles[0].qos.profile.depth == 7
    assert system.executors[0].kind.value == "events"


IMPLIED = "lifecycle: {implied_dependencies: false}\n"
DIRECT = "delivery: dds\n"


@pytest.mark.parametrize(
    ("include", "rest", "part", "expected"),
    [
        pytest.param(
            "{file: camera.yaml, arguments: {rate_hz: often, tpic: x}}", "", "",
            ["whole.yaml:3:46 wrong-type", "whole.yaml:3:53 unknown-variable"], id="arguments",
        ),
        # Only the whole system can set these keys.
        ("part.yaml", "", IMPLIED, ["part.yaml:2:35 invalid-include"]),
        ("part.yaml", "", DIRECT, ["part.yaml:2:11 invalid-include"]),
        ("part.yaml", IMPLIED, IMPLIED, []),
        ("part.yaml", DIRECT, DIRECT, []),
    ],
)  # fmt: skip
def test_places(tmp_path: Path, include: str, rest: str, part: str, expected: list[str]) -> None:
    files = {"part.yaml": f"system: part\n{part}nodes: {{a: {{}}}}\n"}
    assert reported(included(tmp_path, include, rest, files).diagnostics) == expected


def test_a_diagnostic_shows_the_way_to_its_file(tmp_path: Path) -> None:
    files = {
        "parts/wrong.yaml": "system: wrong\nnodes: {a: {lifecycle: {depends_on: [b]}}}\n",
        "parts/middle.yaml": "system: middle\ninclude: [wrong.yaml]\n",
    }
    [diagnostic] = included(tmp_path, "parts/middle.yaml", files=files).diagnostics
    assert str(diagnostic.primary) == "parts/wrong.yaml:2:38"
    assert [str(label.span) for label in diagnostic.related] == [
        "parts/middle.yaml:2:11",
        "whole.yaml:3:5",
    ]


COMMENT = "  # compose: ignore[publisher-without-subscription] people listen by hand"


@pytest.mark.parametrize(
    ("here", "there", "expected"),
    [
        ("", "", ["part.yaml:3:20 publisher-without-subscription"]),
        ("", COMMENT, []),
        (COMMENT, "", []),
    ],
    ids=["without", "in the file", "where it is included"],
)
def test_comments_silence(tmp_path: Path, here: str, there: str, expected: list[str]) -> None:
    port = "{chatter: {type: std_msgs/msg/String, qos: command}}"
    part = f"system: unheard\nnodes:\n  a: {{publishers: {port}}}{there}\n"
    found = included(tmp_path, f"part.yaml{here}", files={"part.yaml": part}).diagnostics
    assert reported(found) == expected


def test_a_comment_for_an_including_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    part = "system: part\nnodes:\n  b:\n    # compose: ignore[start-order] by hand\n"
    part += "    lifecycle: {depends_on: [a]}\n  a: {lifecycle: {autostart: active}}\n"
    write_files(tmp_path, {"part.yaml": part})
    assert together("part.yaml") == ["part.yaml:4:23 unused-ignore"]
    changed = "overrides: {nodes: {a: {lifecycle: {autostart: inactive}}}}"
    whole = f"system: whole\ninclude: [{{file: part.yaml, {changed}}}]\n"
    write_files(tmp_path, {"whole.yaml": whole})
    assert together("part.yaml") == [], "whole.yaml may need it"
    assert together("part.yaml", "whole.yaml") == []


def test_a_folder_reports_diagnostics_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    wrong = """\
system: wrong
nodes:
  a: {lifecycle: {depends_on: [b]}}
connections:
  - {topic: image, from: a.image}
"""
    twice = "for_each: {side: [left, right]}, namespace: '${side}', prefix: '${side}_'"
    files = {
        "wrong.yaml": wrong,
        "whole.yaml": f"system: whole\ninclude: [{{file: wrong.yaml, {twice}}}]\n",
        "other.yaml": "system: other\ninclude: [{file: wrong.yaml, prefix: other_}]\n",
    }
    write_files(tmp_path, files)
    assert together("whole.yaml", "wrong.yaml") == [
        "wrong.yaml:3:32 unknown-node",
        "wrong.yaml:5:28 unknown-port",
    ]
    assert len(load(Path("whole.yaml")).diagnostics) == 2
    assert len(together("whole.yaml", "other.yaml")) == 2


def test_a_cycle_is_reported_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names = {"c.yaml": "a", "a.yaml": "b", "b.yaml": "c"}
    texts = {name: f"system: {name[0]}\ninclude: [{other}.yaml]\n" for name, other in names.items()}
    write_files(tmp_path, texts)
    [diagnostic] = collect_diagnostics(load_files([Path(name) for name in names]))
    assert diagnostic.message == "this includes itself: a.yaml -> b.yaml -> c.yaml -> a.yaml"
    assert str(diagnostic.primary) == "a.yaml:2:11"


def test_files_of_an_included_file_are_next_to_it(tmp_path: Path) -> None:
    files = {
        "arm/arm.yaml": "system: arm\nparameter_files: [arm_parameters.yaml]\n"
        "nodes: {gripper: {type: gripper}, lamp: {behavior: 'lamp:Lamp'}}\n",
        "arm/arm_parameters.yaml": "/left/gripper: {ros__parameters: {speed: 2.0}}\n",
        "arm/nodes/gripper.yaml": "node: gripper\non_activate: {log: ready}\n"
        "parameters: {speed: {type: double, default: 1.0}}\n",
        "arm/lamp.py": "from composer.behavior import Behavior\nclass Lamp(Behavior):\n    pass\n",
    }
    include = "{file: arm/arm.yaml, namespace: left}"
    gripper, lamp = system_of(included(tmp_path, include, files=files)).nodes
    assert gripper.type_found
    assert gripper.parameter("speed").value.value == 2.0
    assert lamp.behavior.folder == tmp_path / "arm"


def test_no_link_leads_out(tmp_path: Path) -> None:
    write_files(tmp_path, {"secret.yaml": "system: secret\nnodes: {a: {}}\n"})
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "linked.yaml").symlink_to(tmp_path / "secret.yaml")
    (inside / "loop.yaml").symlink_to(inside / "loop.yaml")
    loading = included(inside, "linked.yaml\n  - loop.yaml\n  - '\\0'")
    assert [item.message for item in loading.diagnostics] == [
        "'linked.yaml' is outside the project",
        "'loop.yaml' does not exist",
        "'\\0' does not exist",
    ]


@pytest.mark.parametrize(
    ("include", "rule"),
    [
        ("{file: camra.yaml, prefix: left_}", "invalid-include"),
        ("{file: camera.yaml, prefix: left-}", "invalid-include"),
        ("{file: '${file}', prefix: left_}", "unknown-variable"),
        ("{file: broken.yaml, prefix: left_}", "yaml-syntax"),
        ("{file: circle.yaml, prefix: left_}", "cycle"),
        ("{file: circle.yaml, overrides: {nodes: {left_viewer: {}}}}", "cycle"),
    ],
)
def test_nothing_is_a_consequence_of_what_is_missing(
    tmp_path: Path, include: str, rule: str
) -> None:
    rest = """\
nodes:
  recorder:
    executor: vision
    lifecycle: {depends_on: [left_viewer, "left_*"]}
    publishers: {notes: {type: std_msgs/msg/String, qos: frames}}
    subscriptions: {image: {type: std_msgs/msg/String, qos: frames, log: "{message.data}"}}
connections:
  - {topic: image, from: left_driver.image, to: recorder.image}
"""
    circle = "system: circle\ninclude: [whole.yaml]\n"
    files = {"broken.yaml": "system: [\n", "circle.yaml": circle}
    found = reported(included(tmp_path, include, rest, files).diagnostics)
    assert [line.split()[1] for line in found] == [rule]


def test_a_prefix_changes_keys_and_not_the_names_in_ros(tmp_path: Path) -> None:
    robot = """\
system: robot
include:
  - {file: camera.yaml, prefix: left_, namespace: left}
  - {file: camera.yaml, prefix: right_, namespace: right}
"""
    camera = """\
system: camera
nodes:
  driver: {name: camera_driver, external: true}
  viewer: {lifecycle: {depends_on: [driver]}, on_activate: {log: go}}
  filter: {component: {package: demo, plugin: Filter}, container: driver}
"""
    system = load_project(tmp_path, {"robot.yaml": robot, "camera.yaml": camera}).system
    assert {node.name.value: node.full_name for node in system.nodes} == {
        "left_driver": "/left/camera_driver",
        "left_viewer": "/left/left_viewer",
        "left_filter": "/left/left_filter",
        "right_driver": "/right/camera_driver",
        "right_viewer": "/right/right_viewer",
        "right_filter": "/right/right_filter",
    }
    assert system.nodes[1].depends_on[0].node.value == "left_driver"
    assert str(system.nodes[2].container) == "left_driver"


#: Text of a file that is included many times, and the misspelled key, the only one reported.
REPEATED = [
    ("argumnets: {text: hello}\nnodes: {a: {on_activate: {log: '${text}'}}}\n", "argumnets"),
    ("nodse: {a: {on_activate: {log: hello}}}\n", "nodse"),
    ("executers: {fast: {kind: events}}\nnodes: {a: {executor: fast}}\n", "executers"),
    (
        "qos_profile: {odom: {depth: 3}}\nnodes:\n"
        "  a: {publishers: {p: {type: std_msgs/msg/String, qos: odom, external: true}}}\n",
        "qos_profile",
    ),
    # A cycle, and a relative name.
    ("nodes: {a: {lifecycle: {depends_on: [b]}}, b: {lifecycle: {depends_on: [a]}}}\n", None),
    (
        "nodes:\n  a: {services: {ask: {type: std_srvs/srv/Trigger, service: ask/, "
        "external: true, respond: {success: true}}}}\n",
        None,
    ),
]


@pytest.mark.parametrize(("text", "key"), REPEATED)
def test_one_cause_in_many_includes_is_reported_once(
    tmp_path: Path, text: str, key: str | None
) -> None:
    change = ", overrides: {nodes: {a: {description: x}}}" if key else ""
    numbers = range(31)
    includes = [
        f"  - {{file: part.yaml, prefix: p{n}_, namespace: ns{n}{change}}}\n" for n in numbers
    ]
    whole = f"system: whole\ninclude:\n{''.join(includes)}"
    if key:
        depends = ", ".join(f"p{number}_a" for number in range(31))
        whole += f"nodes:\n  last: {{lifecycle: {{depends_on: [{depends}]}}}}\n"
    files = {"whole.yaml": whole, "part.yaml": f"system: part\n{text}"}
    [diagnostic] = load_project(tmp_path, files).diagnostics
    if key:
        assert diagnostic.message == f"'{key}' is not a key of a system"
        assert str(diagnostic.hint).startswith("did you mean '")
    else:
        [alone] = load(tmp_path / "part.yaml").diagnostics
        assert diagnostic.rule == alone.rule
