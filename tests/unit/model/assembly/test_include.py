"""Systems that include systems: the result, and the places of diagnostics."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic
from composer.loading import load, load_files
from composer.loading.reported import LoadResult, collect_diagnostics
from composer.model import System

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


def project(folder: Path, **files: str) -> Path:
    """Write files, ``__`` in a name being a folder's end, and return the first."""
    paths = []
    for name, text in files.items():
        path = folder / f"{name.replace('__', '/')}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        paths.append(path)
    return paths[0]


def included(folder: Path, include: str, rest: str = "", **files: str) -> LoadResult:
    text = f"system: whole\ninclude:\n  - {include}\n{rest}"
    path = project(folder, **{"whole": text, "camera": CAMERA, **files})
    return load(path, shown="whole.yaml")


def system_of(loading: LoadResult) -> System:
    assert [
        f"{item.primary}: {item.message}"
        for item in loading.diagnostics
        if item.rule.name not in QUIET
    ] == []
    assert loading.system is not None
    return loading.system


QUIET = {"impossible-chain"}


def test_wildcards_of_a_parameter_file_apply_to_its_nodes_only(tmp_path: Path) -> None:
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
    ("include", "whole", "full_names", "topic"),
    [
        ("{file: camera.yaml, namespace: left}", "", ["/left/driver", "/left/screen/viewer"],
         "/left/image"),
        ("{file: camera.yaml, namespace: /left}", "namespace: robot\n",
         ["/left/driver", "/left/screen/viewer"], "/left/image"),
        ("{file: camera.yaml, namespace: left}", "namespace: robot\n",
         ["/robot/left/driver", "/robot/left/screen/viewer"], "/robot/left/image"),
        ("{file: camera.yaml, prefix: left_}", "", ["/left_driver", "/screen/left_viewer"],
         "/image"),
        ("{file: camera.yaml, namespace: left, arguments: {topic: /image}}", "",
         ["/left/driver", "/left/screen/viewer"], "/image"),
    ],
)  # fmt: skip
def test_names(tmp_path: Path, include: str, whole: str, full_names: list[str], topic: str) -> None:
    system = system_of(included(tmp_path, include, whole))
    assert [node.full_name for node in system.nodes] == full_names
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
    loading = included(
        tmp_path, "{file: parts/pair.yaml, prefix: first_, namespace: /}", parts__pair=pair
    )
    system = system_of(loading)
    assert [node.full_name for node in system.nodes] == [
        "/pair/left/first_left_driver",
        "/pair/left/screen/first_left_viewer",
        "/pair/right/first_right_driver",
        "/pair/right/screen/first_right_viewer",
        "/pair/first_referee",
    ]
    referee = system.nodes[-1]
    assert [str(item.node) for item in referee.depends_on] == [
        "first_left_viewer",
        "first_right_viewer",
    ]
    assert [port.full_name for port in referee.ports] == ["/pair/left/image"]


def test_arguments_and_the_place_of_their_diagnostics(tmp_path: Path) -> None:
    loading = included(tmp_path, "{file: camera.yaml, arguments: {rate_hz: often, tpic: x}}")
    assert reported(loading.diagnostics) == [
        "whole.yaml:3:46 wrong-type",
        "whole.yaml:3:53 unknown-variable",
    ]


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
    assert gain is not None
    assert (str(gain.type), gain.default.value if gain.default else None) == ("double", 2.5)
    assert gain.maximum is not None
    assert str(gain.maximum.span) == "camera.yaml:10:62"
    assert driver.timers[0].period.unit.value == "period_ms"
    assert system.qos_profiles[0].qos.profile.depth == 7
    assert system.executors[0].kind.value == "events"


def reported(diagnostics: list[Diagnostic]) -> list[str]:
    return [
        f"{item.primary} {item.rule.name}" for item in diagnostics if item.rule.name not in QUIET
    ]


def test_a_diagnostic_shows_the_way_to_its_file(tmp_path: Path) -> None:
    wrong = "system: wrong\nnodes: {a: {lifecycle: {depends_on: [b]}}}\n"
    middle = "system: middle\ninclude: [wrong.yaml]\n"
    loading = included(tmp_path, "parts/middle.yaml", parts__middle=middle, parts__wrong=wrong)
    [diagnostic] = loading.diagnostics
    assert str(diagnostic.primary) == "parts/wrong.yaml:2:38"
    assert [str(label.span) for label in diagnostic.related] == [
        "parts/middle.yaml:2:11",
        "whole.yaml:3:5",
    ]


def test_comments_silence_in_the_file_and_where_it_is_included(tmp_path: Path) -> None:
    unheard = "system: unheard\nnodes:\n  a: {publishers: {chatter: {type: std_msgs/msg/String, "
    unheard += "qos: command}}}"
    comment = "  # compose: ignore[publisher-without-subscription] people listen by hand\n"
    plain = included(tmp_path, "part.yaml", part=unheard + "\n")
    there = included(tmp_path, "part.yaml", part=unheard + comment)
    here = included(tmp_path, "part.yaml" + comment.rstrip(), part=unheard + "\n")
    assert reported(plain.diagnostics) == ["part.yaml:3:20 publisher-without-subscription"]
    assert (reported(there.diagnostics), reported(here.diagnostics)) == ([], [])


def test_a_comment_that_only_an_including_system_needs_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    part = "system: part\nnodes:\n  b:\n    # compose: ignore[start-order] by hand\n"
    part += "    lifecycle: {depends_on: [a]}\n  a: {lifecycle: {autostart: active}}\n"
    changed = "overrides: {nodes: {a: {lifecycle: {autostart: inactive}}}}"
    whole = f"system: whole\ninclude: [{{file: part.yaml, {changed}}}]\n"
    project(tmp_path, part=part)
    unused = ["part.yaml:4:23 unused-ignore"]
    assert reported(collect_diagnostics(load_files([Path("part.yaml")]))) == unused
    project(tmp_path, whole=whole)
    assert collect_diagnostics(load_files([Path("part.yaml")])) == [], "whole.yaml may need it"
    assert collect_diagnostics(load_files([Path("part.yaml"), Path("whole.yaml")])) == []


def test_a_folder_reports_each_diagnostic_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    wrong = """\
system: wrong
nodes:
  a: {lifecycle: {depends_on: [b]}}
connections:
  - {topic: image, from: a.image}
"""
    twice = "for_each: {side: [left, right]}, namespace: '${side}', prefix: '${side}_'"
    project(tmp_path, whole=f"system: whole\ninclude: [{{file: wrong.yaml, {twice}}}]\n")
    project(tmp_path, wrong=wrong)
    assert reported(collect_diagnostics(load_files([Path("whole.yaml"), Path("wrong.yaml")]))) == [
        "wrong.yaml:3:32 unknown-node",
        "wrong.yaml:5:28 unknown-port",
    ]
    assert len(load(Path("whole.yaml")).diagnostics) == 2
    project(tmp_path, other="system: other\ninclude: [{file: wrong.yaml, prefix: other_}]\n")
    assert len(collect_diagnostics(load_files([Path("whole.yaml"), Path("other.yaml")]))) == 2


def test_a_cycle_is_one_diagnostic_wherever_it_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names = ["c", "a", "b"]
    for name, following in zip(names, ["a", "b", "c"], strict=True):
        project(tmp_path, **{name: f"system: {name}\ninclude: [{following}.yaml]\n"})
    [diagnostic] = collect_diagnostics(load_files([Path(f"{name}.yaml") for name in names]))
    assert diagnostic.message == "this includes itself: a.yaml -> b.yaml -> c.yaml -> a.yaml"
    assert str(diagnostic.primary) == "a.yaml:2:11"


def test_node_types_and_behaviors_are_found_next_to_the_included_file(tmp_path: Path) -> None:
    arm = "system: arm\nnodes:\n  gripper: {type: gripper}\n  lamp: {behavior: 'lamp:Lamp'}\n"
    gripper = "node: gripper\non_activate: {log: ready}\n"
    loading = included(tmp_path, "arm/arm.yaml", arm__arm=arm, arm__nodes__gripper=gripper)
    (tmp_path / "arm" / "lamp.py").write_text(
        "from composer.behavior import Behavior\nclass Lamp(Behavior):\n    pass\n"
    )
    loading = load(tmp_path / "whole.yaml", shown="whole.yaml")
    system = system_of(loading)
    assert system.nodes[0].type_found
    assert system.nodes[1].behavior is not None
    assert system.nodes[1].behavior.folder == tmp_path / "arm"


def test_parameter_files_are_relative_to_the_included_file(tmp_path: Path) -> None:
    arm = "system: arm\nparameter_files: [arm_parameters.yaml]\nnodes:\n"
    arm += "  arm: {parameters: {speed: {type: double, default: 1.0}}}\n"
    values = "/left/arm: {ros__parameters: {speed: 2.0}}\n"
    include = "{file: arm/arm.yaml, namespace: left}"
    files = {"arm__arm": arm, "arm__arm_parameters": values}
    system = system_of(included(tmp_path, include, **files))
    speed = system.nodes[0].parameter("speed")
    assert speed is not None
    assert speed.value is not None
    assert speed.value.value == 2.0


def test_what_holds_for_the_whole(tmp_path: Path) -> None:
    part = "system: part\nlifecycle: {implied_dependencies: false}\nnodes: {a: {}}\n"
    assert reported(included(tmp_path, "part.yaml", part=part).diagnostics) == [
        "part.yaml:2:35 invalid-include"
    ]
    direct = "system: part\ndelivery: dds\nnodes: {a: {}}\n"
    assert reported(included(tmp_path, "part.yaml", part=direct).diagnostics) == [
        "part.yaml:2:11 invalid-include"
    ]
    assert (
        reported(included(tmp_path, "part.yaml", "delivery: dds\n", part=direct).diagnostics) == []
    )
    same = "lifecycle: {implied_dependencies: false}\n"
    assert reported(included(tmp_path, "part.yaml", same, part=part).diagnostics) == []


def test_no_link_leads_out(tmp_path: Path) -> None:
    secret = project(tmp_path, secret="system: secret\nnodes: {a: {}}\n")
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "linked.yaml").symlink_to(secret)
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
def test_nothing_is_a_consequence_of_what_is_not_there(
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
    loading = included(tmp_path, include, rest, broken="system: [\n", circle=circle)
    assert [line.split()[1] for line in reported(loading.diagnostics)] == [rule]


def test_a_prefix_changes_keys_and_not_the_names_in_ros(tmp_path: Path) -> None:
    camera = """\
system: camera
nodes:
  driver: {name: camera_driver, external: true}
  viewer: {lifecycle: {depends_on: [driver]}, on_activate: {log: go}}
  filter: {component: {package: demo, plugin: Filter}, container: driver}
"""
    project(
        tmp_path,
        camera=camera,
        robot="""\
system: robot
include:
  - {file: camera.yaml, prefix: left_, namespace: left}
  - {file: camera.yaml, prefix: right_, namespace: right}
""",
    )
    system = load(tmp_path / "robot.yaml").system
    assert system is not None
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
