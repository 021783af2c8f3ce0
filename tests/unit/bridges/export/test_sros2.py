"""Access control policies: exactly what the nodes of each process declare."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from composer.bridges.export.sros2 import enclaves, permissions, policy
from composer.loading import load
from composer.model import PortKind, System
from tests.cli.compose import compose
from tests.programs import require_module

SYSTEM = """\
system: robot
namespace: fleet
nodes:
  talker:
    introspection:
      {parameters: false, rosout: false, type_description: false, lifecycle_services: false}
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
    clients: {reset: {type: std_srvs/srv/Trigger, external: true}}
  listener:
    name: ear
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
    services: {mute: {type: std_srvs/srv/Trigger, service: ~/mute, respond: {success: true}}}
  driver:
    executable: {command: [driver], lifecycle: managed}
    parameters: {use_sim_time: {type: bool, default: true}}
    publishers: {scan: {type: std_msgs/msg/String, qos: command, external: true}}
  other: {external: true}
"""


def resolved(tmp_path: Path, text: str = SYSTEM) -> System:
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    system = load(path).system
    assert system is not None
    return system


def test_a_node_may_do_what_it_declares_and_nothing_else(tmp_path: Path) -> None:
    (enclave,) = enclaves(resolved(tmp_path))
    assert enclave.path == "/fleet/robot"
    profiles = {profile.full_name: profile.names for profile in enclave.profiles}
    assert list(profiles) == [
        "/fleet/robot/manager",
        "/fleet/talker",
        "/fleet/ear",
        "/fleet/driver",
    ]
    assert profiles["/fleet/talker"] == {
        PortKind.PUBLISHER: {"/fleet/chatter"},
        PortKind.CLIENT: {"/fleet/reset"},
    }
    ear = profiles["/fleet/ear"]
    assert ear[PortKind.SUBSCRIPTION] == {"/fleet/chatter"}
    assert ear[PortKind.PUBLISHER] == {
        "/parameter_events",
        "/rosout",
        "/fleet/ear/transition_event",
    }
    assert {"/fleet/ear/mute", "/fleet/ear/change_state"} < ear[PortKind.SERVICE]
    driver = profiles["/fleet/driver"]
    assert driver[PortKind.SUBSCRIPTION] == {"/parameter_events", "/clock"}
    manager = profiles["/fleet/robot/manager"]
    # For nodes that leave it to the manager. Other processes of the system have the other one.
    assert "/fleet/robot/manager/change_state" in manager[PortKind.SERVICE]
    assert "/fleet/robot/manager/change_states" not in manager[PortKind.SERVICE]
    assert manager[PortKind.CLIENT] == {
        "/fleet/robot/manager/_instance_*",
        "/fleet/driver/change_state",
        "/fleet/driver/get_state",
    }


def test_each_process_has_an_enclave(tmp_path: Path) -> None:
    text = SYSTEM.replace("    name: ear\n", "    name: ear\n    process: hearing\n")
    first, second = enclaves(resolved(tmp_path, f"{text}processes: {{hearing: {{}}}}\n"))
    assert second.path == "/fleet/robot/hearing"
    assert [profile.full_name for profile in second.profiles] == [
        "/fleet/robot/hearing/manager",
        "/fleet/ear",
    ]
    assert (
        "/fleet/robot/hearing/manager/change_states" in second.profiles[0].names[PortKind.SERVICE]
    )
    manager = first.profiles[0]
    assert "/fleet/robot/hearing/manager/change_states" in manager.names[PortKind.CLIENT]
    assert "/fleet/robot/hearing/manager/state" in manager.names[PortKind.SUBSCRIPTION]


def test_the_policy_has_the_format_of_sros2(tmp_path: Path) -> None:
    system = resolved(tmp_path)
    text = policy(system)
    assert policy(system) == text
    root = ElementTree.fromstring(text)
    assert (root.tag, root.get("version")) == ("policy", "0.2.0")
    talker = root.find("enclaves/enclave/profiles/profile[@node='talker']")
    assert talker is not None
    assert [(rules.tag, rules.attrib, [item.text for item in rules]) for rules in talker] == [
        ("topics", {"publish": "ALLOW"}, ["/fleet/chatter"]),
        ("services", {"request": "ALLOW"}, ["/fleet/reset"]),
    ]


def test_the_manager_listens_to_transforms_for_all_nodes(tmp_path: Path) -> None:
    text = """\
system: robot
nodes:
  mounts:
    transforms: {static: {laser: {parent: base, translation_m: {x: 1}}}, lookup: [base, laser]}
"""
    (enclave,) = enclaves(resolved(tmp_path, text))
    manager, mounts = (profile.names for profile in enclave.profiles)
    assert {"/tf", "/tf_static"} <= manager[PortKind.SUBSCRIPTION]
    assert "/tf_static" in mounts[PortKind.PUBLISHER]
    assert "/tf" not in mounts[PortKind.PUBLISHER]
    assert PortKind.SUBSCRIPTION not in mounts


def schema(name: str) -> Any:
    """Return a schema of SROS2; see THIRD_PARTY.md."""
    xmlschema = require_module("xmlschema")
    return xmlschema.XMLSchema(Path(__file__).parent / "sros2" / name, allow="local")


PROCESSES = "processes: {hearing: {nodes: [listener]}, acting: {nodes: [arm]}}\n"
ARM = """\
  arm:
    name: arm_1
    action_servers: {move: {type: example_interfaces/action/Fibonacci}}
    action_clients: {look: {type: example_interfaces/action/Fibonacci, external: true}}
"""


def test_the_policy_and_the_permissions_fit_the_schemas_of_sros2(tmp_path: Path) -> None:
    system = resolved(tmp_path, SYSTEM + ARM + PROCESSES)
    schema("policy.xsd").validate(policy(system))
    found = permissions(system, 7)
    assert list(found) == ["/fleet/robot", "/fleet/robot/hearing", "/fleet/robot/acting"]
    for text in found.values():
        schema("permissions.xsd").validate(text)


def test_permissions_name_the_topics_of_dds(tmp_path: Path) -> None:
    system = resolved(tmp_path, SYSTEM + ARM + PROCESSES)
    allowed = {}
    for path, text in permissions(system, 7).items():
        (grant,) = ElementTree.fromstring(text).iter("grant")
        assert grant.findtext("subject_name") == f"CN={path}"
        assert grant.findtext("allow_rule/domains/id") == "7"
        assert grant.findtext("default") == "DENY"
        for direction in ("publish", "subscribe"):
            topics = grant.iterfind(f"allow_rule/{direction}/topics/topic")
            allowed[path, direction] = [topic.text for topic in topics]
            assert allowed[path, direction] == sorted(allowed[path, direction], key=str)
    published, subscribed = (
        set(allowed["/fleet/robot/hearing", direction]) for direction in ("publish", "subscribe")
    )
    assert {"ros_discovery_info", "rt/rosout", "rr/fleet/ear/muteReply"} < published
    assert {"ros_discovery_info", "rt/fleet/chatter", "rq/fleet/ear/muteRequest"} < subscribed
    assert "rt/fleet/chatter" not in published
    assert "rt/fleet/chatter" in allowed["/fleet/robot", "publish"]
    assert "rq/fleet/resetRequest" in allowed["/fleet/robot", "publish"]
    of_arm = [item for item in allowed["/fleet/robot/acting", "publish"] if "_action" in item]
    assert of_arm == [
        "rq/fleet/look/_action/cancel_goalRequest",
        "rq/fleet/look/_action/get_resultRequest",
        "rq/fleet/look/_action/send_goalRequest",
        "rr/fleet/move/_action/cancel_goalReply",
        "rr/fleet/move/_action/get_resultReply",
        "rr/fleet/move/_action/send_goalReply",
        "rt/fleet/move/_action/feedback",
        "rt/fleet/move/_action/status",
    ]


def test_each_process_gets_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    processes = "processes: {hearing: {nodes: [listener]}}\n"
    resolved(tmp_path, SYSTEM + processes)
    done = compose("export", "sros2", "robot.yaml", "--permissions")
    assert done.code == 1
    assert "there are 2 processes: /fleet/robot, /fleet/robot/hearing" in done.err
    done = compose("export", "sros2", "robot.yaml", "--permissions", "-o", "enclaves")
    assert done.code == 0, done.err
    found = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("permissions.xml"))
    assert [str(path.parent) for path in found] == [
        "enclaves/fleet/robot/hearing",
        "enclaves/fleet/robot",
    ]
    monkeypatch.setenv("ROS_DOMAIN_ID", "-1")
    done = compose("export", "sros2", "robot.yaml", "--permissions", "-o", "enclaves", "--force")
    assert (done.code, done.err) == (
        1,
        "compose: ROS_DOMAIN_ID is '-1', which is not a domain id\n",
    )
