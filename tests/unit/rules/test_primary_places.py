"""The primary place of a diagnostic is where the mistake is, not where it is noticed."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load

SERVER = "node: t\nservices: {dose: {type: std_srvs/srv/Trigger, respond: {success: true}}}\n"
VIEWER = "node: t\nstate: {}\ntransforms:\n  lookup: [map, %s]\n"
MOUNTS = "  mounts: {transforms: {static: {base_link: {parent: map, translation_m: {x: 1.0}}}}}\n"
DRIVER = """\
node: t
parameters: {mode: {type: string, default: fast}, text: {type: string, default: '10'}}
timers:
  tick: {rate_hz: '{parameters.%s}', log: tick}
"""
CHOICES = """\
node: t
parameters:
  channel: {type: integer, choices: [a, b]}
on_activate: {when: parameters.channel == 'a', log: first}
"""
#: A node type, the rest of the system, and the only diagnostics: rule, file and line.
PLACES = {
    "two servers that connections give one name": (
        SERVER,
        "  a: {type: t}\n  b: {type: t}\nconnections:\n"
        "  - {service: /one, server: a.dose}\n  - {service: /one, server: b.dose}\n",
        [("duplicate-server", "system.yaml", 7)],
    ),
    "two servers with the name of their type": (
        SERVER,
        "  a: {type: t}\n  b: {type: t}\n",
        [("duplicate-server", "t.yaml", 2)],
    ),
    "a frame of a type whose other frame is known": (
        VIEWER % "gripper",
        f"{MOUNTS}  a: {{type: t}}\n  b: {{type: t}}\n",
        [("unconnected-frames", "t.yaml", 4)],
    ),
    "a frame of a type that is misspelled": (
        VIEWER.replace("map, ", "") % "base_lnik",
        f"{MOUNTS}  a: {{type: t}}\n",
        [("unconnected-frames", "t.yaml", 4)],
    ),
    "a type whose frames the system does not have": (
        VIEWER.replace("map", "wrist") % "gripper",
        f"{MOUNTS}  a: {{type: t}}\n",
        [("unconnected-frames", "system.yaml", 4), ("unconnected-frames", "system.yaml", 4)],
    ),
    "a rate that is a word": (
        DRIVER % "mode",
        "  a: {type: t}\n",
        [("invalid-value", "t.yaml", 4)],
    ),
    "a rate that is a string with a number": (DRIVER % "text", "  a: {type: t}\n", []),
    "choices of another type, and values among them": (
        CHOICES,
        "  a: {type: t, parameters: {channel: a}}\n  b: {type: t, parameters: {channel: b}}\n",
        [("parameter-declaration", "t.yaml", 3)],
    ),
    "a list for another type of field": (
        "node: t\npublishers: {out: {type: sensor_msgs/msg/JointState, external: true,\n"
        "  qos: command}}\ntimers: {tick: {rate_hz: 1,\n"
        "  publish: {out: {name: [1, 2, 3]}}}}\n",
        "  a: {type: t}\n",
        [("invalid-value", "t.yaml", 5)],
    ),
    "a host in a domain that does not exist": (
        "node: t\non_activate: {log: on}\n",
        "  a: {type: t, process: p}\nprocesses: {p: {host: h}}\nhosts:\n"
        "  h: {workspace: ~/robot, environment: {ROS_DOMAIN_ID: 700}}\n",
        [("invalid-host", "system.yaml", 6)],
    ),
}


@pytest.mark.parametrize(("type_", "rest", "expected"), PLACES.values(), ids=PLACES.keys())
def test_a_mistake_is_reported_once_at_its_place(
    tmp_path: Path, type_: str, rest: str, expected: list[tuple[str, str, int]]
) -> None:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "t.yaml").write_text(type_)
    system = tmp_path / "system.yaml"
    system.write_text(f"system: demo\nnodes:\n{rest}")
    found = [
        (item.rule.name, Path(item.primary.file.path).name, item.primary.line)
        for item in load(system).diagnostics
    ]
    assert sorted(found) == expected
