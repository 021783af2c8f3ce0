"""What is missing is reported once, however often it is used."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.rules.test_follow_ups import LISTENER, TALKER, system
from tests.unit.support.checking import rules_broken

EMPTY = "std_msgs/msg/Empty"
#: Mistakes with several uses of what they take away: one diagnostic, with the others as labels.
REMOVED = {
    "a section of profiles": (
        system(
            *(
                f"n{i}: {{publishers: {{o: {{type: {EMPTY}, qos: q{i}, external: true}}}}}}"
                for i in range(4)
            )
        ),
        ["undeclared-name"],
    ),
    "an include with several nodes": (
        system("a: {lifecycle: {depends_on: [camera, lidar, gps]}, on_activate: {log: started}}"),
        ["unknown-node"],
    ),
    "a node that connections and processes name": (
        system(
            "a: {lifecycle: {depends_on: [lidar]}, on_activate: {log: started}}",
            above="processes: {p: {nodes: [lidar, a]}}",
        ),
        ["unknown-node"],
    ),
    "a port that was renamed": (
        system(
            "talker: {publishers: {chat: {type: std_msgs/msg/String, qos: command}},"
            " timers: {tick: {rate_hz: 1, publish: {chatter: {data: x}}}}}",
            LISTENER,
            connections=("{topic: /a, from: talker.chatter, to: listener.chatter}",),
        ),
        ["unknown-port"],
    ),
    "a chain through a port that does not exist is not measured anyway": (
        system(
            TALKER.replace("talker: {", "talker: {executable: {command: [python3]}, "),
            LISTENER,
            above="chains: {c: {through: [talker.chater, talker.chatter], latency_ms: 100}}",
        ),
        ["unknown-port"],
    ),
    "a frame with a misspelled translation": (
        system("a: {transforms: {static: {laser: {parent: base, translation: {x: 1.0}}}}}"),
        ["unknown-key"],
    ),
    "restarts with a misspelled policy": (
        system(
            "a: {on_activate: {log: started}}",
            above="lifecycle: {on_fail: restart, restart: {max_attempts: 2}}",
        ),
        ["unknown-key"],
    ),
    "a rate of a timer that is out of range": (
        system(
            "a: {type: timer_source, variables: {message_type: std_msgs/msg/Empty},"
            " parameters: {rate_hz: 0.0}, publishers: {output: {external: true}}}"
        ),
        ["parameter-value"],
    ),
}


@pytest.mark.parametrize(("text", "expected"), REMOVED.values(), ids=REMOVED.keys())
def test_what_is_removed_or_renamed_is_reported_once(
    tmp_path: Path, text: str, expected: list[str]
) -> None:
    assert rules_broken(text, tmp_path) == expected


def test_names_that_resemble_others_are_reported_each(tmp_path: Path) -> None:
    text = system(
        "camera: {on_activate: {log: started}}",
        "lidar: {on_activate: {log: started}}",
        "receiver: {on_activate: {log: started}}",
        "a: {lifecycle: {depends_on: [camra, lidr, reciever]}, on_activate: {log: started}}",
    )
    assert rules_broken(text, tmp_path) == ["unknown-node"] * 3


SPLIT = """\
system: brake
nodes:
  lidar:
    timers: {tick: {period_ms: 20, publish: {scan: {data: near}}}}
    publishers: {scan: {type: std_msgs/msg/String, qos: sensor_data}}
  brake:
    subscriptions:
      scan: {type: std_msgs/msg/String, qos: sensor_data, publish: {commands: {data: stop}}}
    publishers: {commands: {type: std_msgs/msg/String, qos: command, external: true}}
connections: [{topic: /scan, from: lidar.scan, to: brake.scan}]
processes:
  sensing: {nodes: ["NODES", brake]}
chains:
  stop: {through: [lidar.scan, brake.commands], latency_ms: 50}
"""


@pytest.mark.parametrize(("nodes", "rules"), [("*_lidars", ["unknown-node"]), ("lida*", [])])
def test_a_chain_of_a_process_without_one_of_its_nodes(
    nodes: str, rules: list[str], tmp_path: Path
) -> None:
    assert rules_broken(SPLIT.replace("NODES", nodes), tmp_path) == rules
