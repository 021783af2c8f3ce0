"""Schema mistakes: one diagnostic each, located at the key or value."""

from __future__ import annotations

import pytest

from composer.base.diagnostics import Diagnostic
from composer.language.schema import check_schema, kind_of
from tests.unit.support.resolving import quoted, tree_of


def diagnostics_in(text: str) -> list[Diagnostic]:
    tree = tree_of(text)
    return check_schema(tree, str(kind_of(tree)))


def node(text: str) -> str:
    return f"system: demo\nnodes:\n  robot: {text}"


def connection(text: str) -> str:
    return f"system: demo\nnodes: {{robot: {{}}}}\nconnections: [{text}]"


def timer(text: str) -> str:
    return node(f"{{timers: {{tick: {text}}}}}")


def subscription(text: str) -> str:
    return node(f"{{subscriptions: {{scan: {text}}}}}")


def profile(text: str) -> str:
    return f"system: demo\nnodes: {{robot: {{}}}}\nqos_profiles: {{scan: {text}}}"


@pytest.mark.parametrize(
    ("text", "rule", "mark", "message", "hint"),
    [
        # the file
        ("system: demo", "missing-key", "system", "a system needs 'nodes' or 'in", "nodes: {"),
        ("system: demo\nnodes: {}", "empty-collection", "nodes", "'nodes' is empty", "at least"),
        (
            "system: demo\nnodes: {a: {}}\nchains: {c: {through: [a.p], latency_ms: 5}}",
            "empty-collection", "through", "'through' needs at least 2 entries, and has only 1",
            "add 1",
        ),
        ("system: a\ninclude: []", "empty-collection", "include", "'include' is empty", "at least"),
        (
            "system: 5\nnodes: {robot: {}}",
            "wrong-type", "5", "expected a string for 'system', found the number 5", "quote it",
        ),
        (
            "system: a\nnodes: {robot: {namespace: [b, c]}}",
            "wrong-type", "[", "expected a string for 'namespace', found a list", "write 'b/c'",
        ),
        (
            "system: a\nnodes: {robot: {type: arm, parameters: {gains: {p: 1.0}}}}",
            "wrong-type", "{", "expected true or false, a number", "with a dot: 'gains.p: ...'",
        ),
        (
            "system: demo\nnodes:\n  - robot: {}",
            "wrong-type", "robot", "expected a map for 'nodes', found a list", "without a dash",
        ),
        (
            "system: demo\nnode: {robot: {}}\nnodes: {a: {}}",
            "unknown-key", "node", "'node' is not a key of a system", "valid here: arguments",
        ),
        ("node: demo\nxyzzy: 1", "unknown-key", "xyzzy", "'xyzzy' is not a key of a node type", ""),
        (
            "node: demo\nvariables: 1",
            "wrong-type", "1", "expected a map for 'variables', found the number 1", "",
        ),
        # nodes
        (
            node("{parameters: [robot.yaml]}"),
            "wrong-type", "[", "expected a map for 'parameters'", "'parameter_files'",
        ),
        (
            node("{type: relay, parameters: robot.yaml}"),
            "wrong-type", "robot.yaml", "expected a map for 'parameters'", "'parameter_files'",
        ),
        (
            node("{lifecycle: managed}"),
            "wrong-type", "managed", "expected a map for 'lifecycle'", "write it in 'executable'",
        ),
        (
            node("{executable: {command: [a], lifecycle: {depends_on: [b]}}}"),
            "unknown-word", "{", "expected 'managed' or 'none' for 'lif", "next to 'executable'",
        ),
        (node(""), "wrong-type", "robot", "expected a map for 'robot', found nothing", "'{}'"),
        (
            node("{typ: relay, variables: {a: 1}, publishers: {a: {}}}"),
            "unknown-key", "typ", "'typ' is not a key of inline node 'robot'", "mean 'type'?",
        ),
        (
            node("{type: relay, behavior: a:B}"),
            "unknown-key", "behavior", "'behavior' is not a key of node 'robot'", "remove it",
        ),
        (
            node("{variables: {a: 1}}"),
            "unknown-key", "variables", "'variables' is not a key of inline node", "with a 'type'",
        ),
        (
            node("{subscribers: {scan: {}}}"),
            "unknown-key", "subscribers", "'subscribers' is not a key", "mean 'subscriptions'?",
        ),
        (node("{topics: {}}"), "unknown-key", "topics", "'topics' is not a key", "'publishers'"),
        (node("{params: {}}"), "unknown-key", "params", "'params' is not a key", "'parameters'?"),
        (
            node("{type: relay, parameters: {a: {default: 1}}}"),
            "wrong-type", "{", "expected true or false, a number, a string or a list for 'a'", "",
        ),
        (
            node("{parameters: {a: null}}"),
            "wrong-type", "null", "expected a map, true or false, a number, a string or a list", "",
        ),
        (
            node("{parameters: {a: {type: float}}}"),
            "unknown-word", "float", "expected 'bool', 'integer', 'double'", "",
        ),
        (
            node("{parameters: {a: {default: 1}}}"),
            "missing-key", "a", "parameter 'a' needs the key 'type'", "'type: double'",
        ),
        (
            node("{parameters: {a: {type: double, min: 0.0}}}"),
            "unknown-key", "min", "'min' is not a key of parameter 'a'", "mean 'minimum'?",
        ),
        (
            node("{parameters: {a: {type: bool, read_only: yes}}}"),
            "wrong-type", "yes", "expected true or false for 'read_only'", "write true or false",
        ),
        (
            node("{lifecycle: {depends_on: planner}}"),
            "wrong-type", "planner", "expected a list or a map for 'depends_on'", "a list: [...]",
        ),
        (
            node("{lifecycle: {depends_on: {planner: activ}}}"),
            "unknown-word", "activ", "expected 'active' or 'inactive' for 'planner'", "'active'?",
        ),
        (
            "system: demo\nnodes: {a: {}}\nexecutors: {b: {priority: 100}}",
            "out-of-range", "100", "expected at most 99 for 'priority', found 100", "",
        ),
        (
            "system: demo\nnodes: {a: {}}\nexecutors: {b: {cpus: [0, -1]}}",
            "out-of-range", "-1", "expected at least 0", "",
        ),
        # ports
        (
            node("{publishers: {chatter: {topic: /a}}}"),
            "missing-key", "chatter", "publisher 'chatter' needs the key 'type'", "/msg/",
        ),
        (
            node("{clients: {plan: {}}}"),
            "missing-key", "plan", "client 'plan' needs the key 'type'", "/srv/",
        ),
        (
            node("{action_servers: {go: {}}}"),
            "missing-key", "go", "action server 'go' needs the key 'type'", "/action/",
        ),
        (
            subscription("{message_type: a/msg/B}"),
            "unknown-key", "message_type", "'message_type' is not a key", "mean 'type'?",
        ),
        (
            subscription("{type: a/msg/B, qos: 10}"),
            "wrong-type", "10", "expected a string or a map for 'qos', found the number 10", "",
        ),
        (
            subscription("{type: a/msg/B, qos: {reliability: best-effort}}"),
            "unknown-word", "best-effort", "expected 'reliable' or 'best_effort'", "'best_effort'?",
        ),
        (
            subscription("{type: a/msg/B, callback: x}"),
            "unknown-key", "callback", "'callback' is not a key of subscription 'scan'", "when,",
        ),
        (
            subscription("{type: a/msg/B, when: true}"),
            "wrong-type", "true", "expected a string for 'when', found true", "quote it",
        ),
        (
            subscription("{type: a/msg/B, publish: {out: hello}}"),
            "wrong-type", "hello", "expected a map or an '{expression}' for 'out'", "{data: ...}",
        ),
        (
            subscription("{type: a/msg/B, log: {level: warning, message: x}}"),
            "unknown-word", "warning", "expected 'debug', 'info', 'warn', 'error' or", "'warn'?",
        ),
        (
            subscription("{type: a/msg/B, log: {level: warn}}"),
            "missing-key", "log", "this log needs the key 'message'", "",
        ),
        (
            node("{services: {s: {type: a/srv/B, when: x}}}"),
            "unknown-key", "when", "'when' is not a key of service 's'", "every request",
        ),
        (
            node("{action_servers: {s: {type: a/action/B, feedback: {count: 3}}}}"),
            "missing-key", "feedback", "this feedback needs the key 'period_ms'", "",
        ),
        # timers
        (timer(""), "wrong-type", "tick", "expected a map for 'tick', found nothing", "'{}'"),
        (timer("{}"), "missing-key", "tick", "timer 'tick' needs 'period_ms' or 'rate_hz'", ""),
        (
            timer("{rate_hz: 1, period_ms: 2}"),
            "keys-exclude-each-other", "period_ms",
            "timer 'tick' has both 'rate_hz' and 'period_ms'", "keep one",
        ),
        (
            timer("{frequency: 10}"),
            "unknown-key", "frequency", "'frequency' is not a key of timer 'tick'", "'rate_hz'?",
        ),
        (timer("{hz: 10}"), "unknown-key", "hz", "'hz' is not a key of timer", "'rate_hz'?"),
        (timer("{period: 1}"), "unknown-key", "period", "'period' is not", "'period_ms'?"),
        (
            timer("{rate_hz: 10 Hz}"),
            "wrong-type", "10 Hz", "expected a number or an '{expression}' for 'rate_hz'", "unit",
        ),
        (
            timer("{rate_hz: 0}"),
            "out-of-range", "0", "expected a number above 0 for 'rate_hz', found 0", "",
        ),
        (
            timer("{rate_hz: true}"),
            "wrong-type", "true", "expected a number or an '{expression}' for 'rate_hz'", "",
        ),
        # connections
        (
            connection("{topic: /a}"),
            "missing-key", "{", "this topic connection needs 'from' or 'to'", "",
        ),
        (
            connection("{service: /a}"),
            "missing-key", "{", "this service connection needs 'server' or 'clients'", "",
        ),
        (
            connection("{from: a.b, to: c.d}"),
            "missing-key", "{", "this connection needs 'topic', 'service' or 'action'", "",
        ),
        (
            connection("{topc: /a, from: a.b, to: []}"),
            "unknown-key", "topc", "'topc' is not a key of this connection", "mean 'topic'?",
        ),
        (
            connection("{topic: /a, source: a.b}"),
            "unknown-key", "source", "'source' is not a key of this topic connection", "'from'?",
        ),
        (
            connection("{service: /a, from: a.b}"),
            "unknown-key", "from", "'from' is not a key of this service connection", "'server'?",
        ),
        (
            connection("{topic: /a, from: a.b, to: []}"),
            "empty-collection", "to", "'to' is empty", "at least one",
        ),
        (
            connection("{topic: /a, from: a.b, to: [3]}"),
            "wrong-type", "3", "expected a string in 'to', found the number 3", "",
        ),
        (
            connection("/a"),
            "wrong-type", "/a", "expected a map in 'connections', found the string '/a'", "",
        ),
        # profiles and executors
        (profile("{depth: 0}"), "out-of-range", "0", "expected at least 1 for 'depth'", ""),
        (profile("{depth: 1.0}"), "wrong-type", "1.0", "expected an integer for 'depth'", ""),
        (
            profile("{deadline_ms: 0}"),
            "out-of-range", "0", "expected a number above 0 for 'deadline_ms', found 0", "",
        ),
        (profile("{deadline: 5}"), "unknown-key", "deadline", "'deadline' is", "'deadline_ms'?"),
        (profile("{queue_size: 5}"), "unknown-key", "queue_size", "'queue_size'", "'depth'?"),
        (profile("sensor_data"), "wrong-type", "sensor_data", "expected a map for 'scan'", ""),
        (
            "system: demo\nnodes: {a: {}}\nexecutors: {b: {kind: multithreaded}}",
            "unknown-word", "multithreaded", "expected 'events', 'single_threaded' or", "",
        ),
    ],
)  # fmt: skip
def test_diagnostic(text: str, rule: str, mark: str, message: str, hint: str) -> None:
    (diagnostic,) = diagnostics_in(text)
    assert (diagnostic.rule.name, quoted(diagnostic.primary)) == (rule, mark)
    assert diagnostic.message.startswith(message)
    assert hint in (diagnostic.hint or "")


def test_two_keys_that_say_the_same_are_both_shown() -> None:
    (diagnostic,) = diagnostics_in(timer("{rate_hz: 1, period_ms: 2}"))
    assert [label.span.column for label in diagnostic.related] == [27]


@pytest.mark.parametrize(
    "text",
    [
        node("{}"),
        node("{type: relay}"),
        node("{type: relay, variables: {qos: {depth: 1}}, publishers: {output: {topic: /a}}}"),
        node("{type: relay, timers: {tick: {period_ms: 5}}, remappings: {a: /b}}"),
        node("{parameters: {a: 1, b: [1, 2], c: x, d: false, e: 1.0}}"),
        node("{parameters: {a: {type: string, choices: [x, y], default: x, read_only: true}}}"),
        node("{lifecycle: {depends_on: {a: inactive, b: active}, autostart: unconfigured}}"),
        node("{state: {a: [1], b: null}, on_activate: {set: {a: 1}, log: x}}"),
        timer("{rate_hz: '{parameters.rate_hz}'}"),
        timer("{period_ms: 0.5, publish: {a: {}, b: '{message}'}, call: {c: {x: {y: [1]}}}}"),
        profile("{extends: sensor_data, depth: 1, deadline_ms: null, lifespan_ms: 1.5}"),
        connection("{topic: /a, from: a.b}, {topic: /a, to: [a.b, c.d], qos: state}"),
        connection("{service: /a, server: a.b}, {action: /a, clients: [a.b]}"),
        "node: relay\nvariables: {a: {}, b: {description: x, default: null}}",
    ],
)
def test_what_is_right(text: str) -> None:
    assert [diagnostic.message for diagnostic in diagnostics_in(text)] == []


@pytest.mark.parametrize(
    "text",
    [
        timer("{rate_hz: '${rate}', reentrant: '${flag}'}"),
        profile("{depth: '${depth}', reliability: '${reliability}', lifespan_ms: '${ms}'}"),
        subscription("{type: '${type}', qos: '${qos}', required: '${flag}', publish: {a: '${b}'}}"),
        node("{type: '${type}', lifecycle: {depends_on: '${nodes}', autostart: '${state}'}}"),
        node("{parameters: {a: {type: '${type}', minimum: '${low}', choices: '${list}'}}}"),
        node("{action_servers: {a: {type: x, feedback: {count: '${n}', period_ms: '${ms}'}}}}"),
        node("{clients: {a: {type: x, timeout_ms: '${ms}', on_response: {log: {level: '${l}', "
             "message: x}}}}}"),
        connection("{topic: '${topic}', from: '${ends}', qos: '${qos}'}"),
        "system: demo\nnodes: {a: {}}\nexecutors: {b: {kind: '${kind}', threads: '${threads}'}}",
    ],
)  # fmt: skip
def test_variable_without_value_fits_everywhere(text: str) -> None:
    assert [diagnostic.message for diagnostic in diagnostics_in(text)] == []


def test_all_mistakes_in_one_run() -> None:
    diagnostics = diagnostics_in(
        """
        system: demo
        namspace: /robot
        nodes:
          a: {timers: {t: {frequency: 10}, u: {rate_hz: -1}}}
          b: {publishers: {p: {typ: x}, q: {type: x, qos: {depth: many}}}}
          c: {type: relay, params: {x: 1}, lifecycle: {autostart: now}}
        connections:
          - {topic: /a}
          - {form: a.b, topic: /b, to: c.d}
        """
    )
    assert sorted((str(item.primary), item.rule.code) for item in diagnostics) == [
        ("f:10:6", "RC101"),
        ("f:3:1", "RC101"),
        ("f:5:20", "RC101"),
        ("f:5:49", "RC105"),
        ("f:6:24", "RC101"),
        ("f:6:59", "RC103"),
        ("f:7:20", "RC101"),
        ("f:7:59", "RC104"),
        ("f:9:5", "RC102"),
    ]


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("system: a", "system"),
        ("node: a", "node"),
        ("description: x\nnode: a", "node"),
        ("node: a\nsystem: b", "node"),
        ("nodes: {}", None),
        ("a: {system: b}", None),
    ],
)
def test_kind(text: str, kind: str | None) -> None:
    assert kind_of(tree_of(text)) == kind


def test_long_and_hostile_keys_are_cut_and_escaped() -> None:
    (diagnostic,) = diagnostics_in(f"system: demo\nnodes: {{a: {{}}}}\n'\xa0{'x' * 900}': 1")
    assert diagnostic.message.startswith("'\\xa0xxx")
    assert len(diagnostic.message) < 120
