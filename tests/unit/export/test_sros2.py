"""Access control policies: exactly what the nodes of each process declare."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from composer.export.sros2 import enclaves, policy
from composer.loading import load
from composer.model import PortKind, System

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
    manager = first.profiles[0]
    assert "/fleet/robot/hearing/manager/change_state" in manager.names[PortKind.CLIENT]
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
