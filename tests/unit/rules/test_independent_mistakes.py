"""Mistakes that do not follow from another one are all reported."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.rules.test_follow_ups import LISTENER, TALKER, system
from tests.unit.support.checking import rules_broken


def test_a_warning_does_not_hide_errors(tmp_path: Path) -> None:
    of_program = (
        "{external: true, publishers: {out: {type: std_msgs/msg/String, qos: sensor_data}}}"
    )
    offered = "{type: std_msgs/msg/String, qos: {reliability: best_effort}, external: true}"
    requested = "{type: std_msgs/msg/String, qos: {reliability: reliable}, log: text}"
    text = system(
        f"program: {of_program}",
        "reader: {subscriptions: {in: {type: std_msgs/msg/String, qos: sensor_data, log: text}}}",
        f"first: {{publishers: {{other: {offered}}}}}",
        f"second: {{subscriptions: {{other: {requested}}}}}",
        connections=("{topic: /a, from: program.out, to: reader.in, qos: command}",),
    )
    assert sorted(rules_broken(text, tmp_path)) == ["outside-qos", "qos-incompatible"]


MOUNTS = "mounts: {transforms: {static: {odom: {parent: odom, translation_m: {x: 1.0}}}}}"
UNHEARD = "other: {subscriptions: {scan: {type: std_msgs/msg/String, qos: command, log: text}}}"
INDEPENDENT = {
    "a frame that is looked up without a frame of the cycle": (
        system(
            MOUNTS,
            "arm: {transforms: {static: {hand: {parent: wrist, translation_m: {x: 1.0}}}}}",
            "viewer: {external: true, transforms: {lookup: [gripper, wrist]}}",
        ),
        ["conflicting-transforms", "unconnected-frames"],
    ),
    "a port that has nothing to do with the misspelled reference": (
        system(
            TALKER,
            LISTENER,
            UNHEARD,
            connections=("{topic: /a, from: talkr.chatter, to: listener.chatter}",),
        ),
        ["subscription-without-publisher", "unknown-node"],
    ),
    "a port outside of the invalid namespace": (
        system(
            TALKER.replace("{pub", "{namespace: a-b, pub"),
            LISTENER.replace("type", "topic: /a/chatter, type"),
            UNHEARD,
        ),
        ["invalid-name", "subscription-without-publisher"],
    ),
    "the best effort commands of another node": (
        system(
            "program: {external: true, publishers: "
            "{out: {type: std_msgs/msg/String, qos: sensor_data}}}",
            "reader: {subscriptions: {in: {type: std_msgs/msg/String, qos: sensor_data, "
            "log: text}}}",
            "driver: {publishers: {cmd_vel: {type: std_msgs/msg/String, qos: sensor_data, "
            "external: true}}}",
            connections=("{topic: /a, from: program.out, to: reader.in, qos: command}",),
        ),
        ["outside-qos", "unsuited-qos"],
    ),
    "an executor that other processes share": (
        system(
            "motor: {process: remotes, on_activate: {log: started}}",
            "left: {process: other, executor: fast, on_activate: {log: started}}",
            "right: {executor: fast, on_activate: {log: started}}",
            above="processes: {remote: {memory_mb: 100}, other: {memory_mb: 100}}\n"
            "executors: {fast: {kind: single_threaded}}",
        ),
        ["lost-between-processes", "undeclared-name"],
    ),
}


@pytest.mark.parametrize(("text", "rules"), INDEPENDENT.values(), ids=INDEPENDENT.keys())
def test_what_does_not_follow_from_a_mistake_is_reported(
    text: str, rules: list[str], tmp_path: Path
) -> None:
    assert sorted(rules_broken(text, tmp_path)) == rules
