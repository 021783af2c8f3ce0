"""One mistake in the files of a small project gives one report, where the mistake is."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import Places, places_in

TALK = "{type: std_msgs/msg/String, qos: command"
ECHO = f"""\
system: echo
nodes:
  source:
    publishers: {{out: {TALK}}}}}
    timers: {{tick: {{period_ms: 1000, publish: {{out: {{data: a}}}}}}}}
  echo:
    subscriptions: {{in: {TALK}, topic: out, when: count > 1, publish: {{out: '{{message}}'}}}}}}
    publishers: {{out: {TALK}}}}}
"""
SHARED = f"""\
system: shared
nodes:
  source:
    publishers: {{out: {TALK}}}}}
    timers: {{tick: {{period_ms: 1000, publish: {{out: {{data: a}}}}}}}}
  both:
    publishers: {{out: {TALK}}}}}
    subscriptions: {{in: {TALK}, topic: out, log: a}}}}
    timers: {{tick: {{period_ms: 1000, publish: {{out: {{data: a}}}}}}}}
  sink: {{subscriptions: {{in: {TALK}, topic: out, log: a}}}}}}
"""
RESTART = """\
system: a
lifecycle: {watch: {max_errors: 2}}
nodes:
  n:
    on_activate: {log: a}
    lifecycle: {restart: {%s}}
"""
FLOAT = "{type: std_msgs/msg/Float64, qos: command"
SINK = f"node: sink\nsubscriptions: {{in: {FLOAT}, topic: /x}}}}\n"
SOURCE = "  source: {publishers: {out: {type: std_msgs/msg/String, qos: command, topic: /x}}}\n"
NAMED = """\
system: a
parameter_files: values.yaml
nodes:
  first: {name: n, parameters: {size: 1.0}}
  n: {parameters: {names: {type: string_array, default: [a]}, far: 2.0}}
"""
VALUES = "/n:\n  ros__parameters:\n    %s\n"
PROCESSES = """\
system: a
processes: {night: {cpus: [1]}}
nodes:
  n: {process: day, on_activate: {log: a}}
"""
CAMERA = "node: camera\nparameters: {serial: {type: string}}\non_activate: {log: a}\n"
TWICE = f"""\
system: a
nodes:
  a: {{publishers: {{out: {TALK}}}}}}}
  b: {{subscriptions: {{in: {TALK}, log: a}}}}}}
  c: {{subscriptions: {{in: {TALK}, external: true, log: a}}}}}}
connections:
  - {{topic: /x, from: a.out, to: [b.in, b.in]}}
"""
OUTSIDE = "/n:\n  ros__parameters:\n  far: 2.0\n"
STREAM = """\
system: a
nodes:
  source:
    publishers: {out: {type: std_msgs/msg/String, qos: sensor_data, topic: /x}}
    timers: {tick: {period_ms: 100, publish: {out: {data: a}}}}
  near: {subscriptions: {in: {type: std_msgs/msg/String, qos: sensor_data, topic: /x, log: a}}}
  far: {subscriptions: {in: {type: std_msgs/msg/String, qos: state, topic: /x, log: a}}}
"""
COLONS = """\
system: a
nodes:
  b: {on_activate: {log: a}}
  c:
"""

MISTAKES: dict[str, tuple[dict[str, str], Places]] = {
    "a condition does not end a loop through one topic": (
        {"system.yaml": ECHO},
        [("topic-loop", "system.yaml", 7)],
    ),
    "a topic on which others publish and subscribe too": ({"system.yaml": SHARED}, []),
    "errors are counted in the window only": (
        {"system.yaml": RESTART % "max_attempts: 3"},
        [("failure-settings", "system.yaml", 6)],
    ),
    "a window for errors": ({"system.yaml": RESTART % "window_ms: 300"}, []),
    "two nodes with one name, and parameters of one of them": (
        {"system.yaml": NAMED, "values.yaml": VALUES % "far: 3.0"},
        [("duplicate-name", "system.yaml", 5)],
    ),
    "a section of parameters for another node": (
        {
            "system.yaml": "system: a\nparameter_files: values.yaml\nnodes:\n"
            "  n: {parameters: {size: 1.0}}\n  m: {parameters: {near: 1.0, far: 2.0}}\n",
            "values.yaml": "/n:\n  ros__parameters:\n    near: 3.0\n    far: 4.0\n",
        },
        [("unknown-parameter", "values.yaml", 3)],
    ),
    "a map for a parameter": (
        {
            "system.yaml": NAMED.replace("name: n", "name: m"),
            "values.yaml": VALUES % "names: {left: a, right: b}",
        },
        [("unknown-parameter", "values.yaml", 3)],
    ),
    "a type that differs from that of a node type": (
        {
            "system.yaml": f"system: a\nnodes:\n  s: {{type: sink}}\n{SOURCE}",
            "nodes/sink.yaml": SINK,
        },
        [("type-mismatch", "system.yaml", 4)],
    ),
    "a port that is named twice": (
        {"system.yaml": TWICE},
        [("port-connected-twice", "system.yaml", 7)],
    ),
    "a loop over a word, in a file that is included twice": (
        {
            "system.yaml": "system: a\ninclude:\n  - {file: part.yaml, prefix: a_, namespace: a}\n"
            "  - {file: part.yaml, prefix: b_, namespace: b}\n",
            "part.yaml": "system: part\nnodes:\n  n_${i}:\n    for_each: {i: names}\n"
            f"    publishers: {{out: {TALK}, external: true}}}}\n"
            "connections:\n  - {topic: x, from: n_*.out}\n",
        },
        [("wrong-type", "part.yaml", 4)],
    ),
    "a parameter next to the parameters": (
        {"system.yaml": NAMED.replace("name: n", "name: m"), "values.yaml": OUTSIDE},
        [("parameter-file", "values.yaml", 3)],
    ),
    "a subscription that asks a stream for the latest value": (
        {"system.yaml": STREAM},
        [("qos-incompatible", "system.yaml", 7)],
    ),
    "colons without a space": (
        {"system.yaml": f"{COLONS}    lifecycle: {{depends_on: {{b:active}}}}\n"},
        [("key-without-value", "system.yaml", 5)],
    ),
    "a process whose name is wrong": (
        {"system.yaml": PROCESSES},
        [("undeclared-name", "system.yaml", 4)],
    ),
    "a misspelled key of a section": (
        {
            "system.yaml": "system: a\nnodes:\n  c: {type: camera, parameter: {serial: a}}\n",
            "nodes/camera.yaml": CAMERA,
        },
        [("unknown-key", "system.yaml", 3)],
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_reported_once(name: str, tmp_path: Path) -> None:
    files, expected = MISTAKES[name]
    assert places_in(files, tmp_path) == expected
