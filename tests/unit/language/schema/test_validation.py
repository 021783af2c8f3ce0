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


#: By rule: texts, what is marked (the first word of the message about a key), message and hint.
MISTAKES: dict[str, list[tuple[str, ...]]] = {
    "missing-key": [
        ("system: demo", "system", "a system needs 'nodes' or 'in", "nodes: {"),
        (node("{parameters: {a: {default: 1}}}"),
         "a", "parameter 'a' needs the key 'type'", "'type: double'"),
        (node("{publishers: {chatter: {topic: /a}}}"),
         "chatter", "publisher 'chatter' needs the key 'type'", "/msg/"),
        (node("{clients: {plan: {}}}"), "plan", "client 'plan' needs the key 'type'", "/srv/"),
        (node("{action_servers: {go: {}}}"),
         "go", "action server 'go' needs the key 'type'", "/action/"),
        (subscription("{type: a/msg/B, log: {level: warn}}"),
         "log", "this log needs the key 'message'", ""),
        (node("{action_servers: {s: {type: a/action/B, feedback: {count: 3}}}}"),
         "feedback", "this feedback needs the key 'period_ms'", ""),
        (timer("{}"), "tick", "timer 'tick' needs 'period_ms' or 'rate_hz'", ""),
        (connection("{topic: /a}"), "{", "this topic connection needs 'from' or 'to'", ""),
        (connection("{service: /a}"),
         "{", "this service connection needs 'server' or 'clients'", ""),
        (connection("{from: a.b, to: c.d}"),
         "{", "this connection needs 'topic', 'service' or 'action'", ""),
    ],
    "empty-collection": [
        ("system: demo\nnodes: {}", "nodes", "'nodes' is empty", "at least"),
        ("system: demo\nnodes: {a: {}}\nchains: {c: {through: [a.p], latency_ms: 5}}",
         "through", "'through' needs at least 2 entries, and has only 1", "add 1"),
        ("system: a\ninclude: []", "include", "'include' is empty", "at least"),
        (connection("{topic: /a, from: a.b, to: []}"), "to", "'to' is empty", "at least one"),
    ],
    "wrong-type": [
        ("system: 5\nnodes: {robot: {}}",
         "5", "expected a string for 'system', found the number 5", "quote it"),
        ("system: a\nnodes: {robot: {namespace: [b, c]}}",
         "[", "expected a string for 'namespace', found a list", "write 'b/c'"),
        ("system: a\nnodes: {robot: {type: arm, parameters: {gains: {p: 1.0}}}}",
         "{", "expected true or false, a number", "with a dot: 'gains.p: ...'"),
        ("system: demo\nnodes:\n  - robot: {}",
         "robot", "expected a map for 'nodes', found a list", "without a dash"),
        ("node: demo\nvariables: 1", "1", "expected a map for 'variables', found the number 1", ""),
        (node("{parameters: [robot.yaml]}"),
         "[", "expected a map for 'parameters'", "'parameter_files'"),
        (node("{type: relay, parameters: robot.yaml}"),
         "robot.yaml", "expected a map for 'parameters'", "'parameter_files'"),
        (node("{lifecycle: managed}"),
         "managed", "expected a map for 'lifecycle'", "write it in 'executable'"),
        (node(""), "robot", "expected a map for 'robot', found nothing", "'{}'"),
        (node("{type: relay, parameters: {a: {default: 1}}}"),
         "{", "expected true or false, a number, a string or a list for 'a'", ""),
        (node("{parameters: {a: null}}"),
         "null", "expected a map, true or false, a number, a string or a list", ""),
        (node("{parameters: {a: {type: bool, read_only: yes}}}"),
         "yes", "expected true or false for 'read_only'", "write true or false"),
        (node("{lifecycle: {depends_on: planner}}"),
         "planner", "expected a list or a map for 'depends_on'", "a list: [...]"),
        (subscription("{type: a/msg/B, qos: 10}"),
         "10", "expected a string or a map for 'qos', found the number 10", ""),
        (subscription("{type: a/msg/B, when: true}"),
         "true", "expected a string for 'when', found true", "quote it"),
        (subscription("{type: a/msg/B, publish: {out: hello}}"),
         "hello", "expected a map or an '{expression}' for 'out'", "{data: ...}"),
        (timer(""), "tick", "expected a map for 'tick', found nothing", "'{}'"),
        (timer("{rate_hz: 10 Hz}"),
         "10 Hz", "expected a number or an '{expression}' for 'rate_hz'", "unit"),
        (timer("{rate_hz: true}"),
         "true", "expected a number or an '{expression}' for 'rate_hz'", ""),
        (connection("{topic: /a, from: a.b, to: [3]}"),
         "3", "expected a string in 'to', found the number 3", ""),
        (connection("/a"), "/a", "expected a map in 'connections', found the string '/a'", ""),
        (profile("{depth: 1.0}"), "1.0", "expected an integer for 'depth'", ""),
        (profile("sensor_data"), "sensor_data", "expected a map for 'scan'", ""),
    ],
    "unknown-key": [
        ("system: demo\nnode: {robot: {}}\nnodes: {a: {}}",
         "'node' is not a key of a system", "valid here: arguments"),
        ("node: demo\nxyzzy: 1", "'xyzzy' is not a key of a node type", ""),
        (node("{typ: relay, variables: {a: 1}, publishers: {a: {}}}"),
         "'typ' is not a key of inline node 'robot'", "mean 'type'?"),
        (node("{type: relay, behavior: a:B}"),
         "'behavior' is not a key of node 'robot'", "remove it"),
        (node("{variables: {a: 1}}"), "'variables' is not a key of inline node", "with a 'type'"),
        (node("{subscribers: {scan: {}}}"), "'subscribers' is not a key", "mean 'subscriptions'?"),
        (node("{topics: {}}"), "'topics' is not a key", "'publishers'"),
        (node("{params: {}}"), "'params' is not a key", "'parameters'?"),
        (node("{parameters: {a: {type: double, min: 0.0}}}"),
         "'min' is not a key of parameter 'a'", "mean 'minimum'?"),
        (subscription("{message_type: a/msg/B}"), "'message_type' is not a key", "mean 'type'?"),
        (subscription("{type: a/msg/B, callback: x}"),
         "'callback' is not a key of subscription 'scan'", "when,"),
        (node("{services: {s: {type: a/srv/B, when: x}}}"),
         "'when' is not a key of service 's'", "every request"),
        (node("{services: {s: {type: a/srv/B, timeout_ms: 1}}}"),
         "'timeout_ms' is not a key of service 's'", "under 'clients' have this key"),
        (node("{action_clients: {s: {type: a/action/B, result: {}}}}"),
         "'result' is not a key of action client 's'", "under 'action_servers'"),
        (timer("{frequency: 10}"), "'frequency' is not a key of timer 'tick'", "'rate_hz'?"),
        (timer("{hz: 10}"), "'hz' is not a key of timer", "'rate_hz'?"),
        (timer("{period: 1}"), "'period' is not", "'period_ms'?"),
        (connection("{topc: /a, from: a.b, to: []}"),
         "'topc' is not a key of this connection", "mean 'topic'?"),
        (connection("{topic: /a, source: a.b}"),
         "'source' is not a key of this topic connection", "'from'?"),
        (connection("{service: /a, from: a.b}"),
         "'from' is not a key of this service connection", "'server'?"),
        (profile("{deadline: 5}"), "'deadline' is", "'deadline_ms'?"),
        (profile("{queue_size: 5}"), "'queue_size'", "'depth'?"),
    ],
    "unknown-word": [
        (node("{executable: {command: [a], lifecycle: {depends_on: [b]}}}"),
         "{", "expected 'managed' or 'none' for 'lif", "next to 'executable'"),
        (node("{parameters: {a: {type: float}}}"),
         "float", "expected 'bool', 'integer', 'double'", ""),
        (node("{lifecycle: {depends_on: {planner: activ}}}"),
         "activ", "expected 'active' or 'inactive' for 'planner'", "'active'?"),
        (subscription("{type: a/msg/B, qos: {reliability: best-effort}}"),
         "best-effort", "expected 'reliable' or 'best_effort'", "'best_effort'?"),
        (subscription("{type: a/msg/B, log: {level: warning, message: x}}"),
         "warning", "expected 'debug', 'info', 'warn', 'error' or", "'warn'?"),
        ("system: demo\nnodes: {a: {}}\nexecutors: {b: {kind: multithreaded}}",
         "multithreaded", "expected 'events', 'single_threaded' or", ""),
    ],
    "out-of-range": [
        ("system: demo\nnodes: {a: {}}\nexecutors: {b: {priority: 100}}",
         "100", "expected at most 99 for 'priority', found 100", ""),
        ("system: demo\nnodes: {a: {}}\nexecutors: {b: {cpus: [0, -1]}}",
         "-1", "expected at least 0", ""),
        (timer("{rate_hz: 0}"), "0", "expected a number above 0 for 'rate_hz', found 0", ""),
        (profile("{depth: 0}"), "0", "expected at least 1 for 'depth'", ""),
        (profile("{deadline_ms: 0}"),
         "0", "expected a number above 0 for 'deadline_ms', found 0", ""),
    ],
    "keys-exclude-each-other": [
        (timer("{rate_hz: 1, period_ms: 2}"),
         "period_ms", "timer 'tick' has both 'rate_hz' and 'period_ms'", "keep one"),
    ],
}  # fmt: skip


@pytest.mark.parametrize(
    ("rule", "text", "mark", "message", "hint"),
    [
        (rule, text, *(mark or [message.split("'")[1]]), message, hint)
        for rule, cases in MISTAKES.items()
        for text, *mark, message, hint in cases
    ],
)
def test_diagnostic(rule: str, text: str, mark: str, message: str, hint: str) -> None:
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
        # A variable without a value fits everywhere.
        timer("{rate_hz: '${rate}', reentrant: '${flag}'}"),
        profile("{depth: '${depth}', reliability: '${reliability}', lifespan_ms: '${ms}'}"),
        subscription("{type: '${type}', qos: '${qos}', required: '${flag}', publish: {a: '${b}'}}"),
        node("{type: '${type}', lifecycle: {depends_on: '${nodes}', autostart: '${state}'}}"),
        node("{parameters: {a: {type: '${type}', minimum: '${low}', choices: '${list}'}}}"),
        node("{action_servers: {a: {type: x, feedback: {count: '${n}', period_ms: '${ms}'}}}}"),
        node("{clients: {a: {type: x, timeout_ms: '${ms}'}}}"),
        node("{on_activate: {log: {level: '${l}', message: x}}}"),
        connection("{topic: '${topic}', from: '${ends}', qos: '${qos}'}"),
        "system: demo\nnodes: {a: {}}\nexecutors: {b: {kind: '${kind}', threads: '${threads}'}}",
    ],
)
def test_what_is_right(text: str) -> None:
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


def test_kind() -> None:
    texts = ("system: a", "node: a", "description: x\nnode: a", "node: a\nsystem: b")
    assert [kind_of(tree_of(text)) for text in texts] == ["system", "node", "node", "node"]
    for text in ("nodes: {}", "a: {system: b}"):
        assert kind_of(tree_of(text)) is None


def test_long_and_hostile_keys_are_cut_and_escaped() -> None:
    (diagnostic,) = diagnostics_in(f"system: demo\nnodes: {{a: {{}}}}\n'\xa0{'x' * 900}': 1")
    assert diagnostic.message.startswith("'\\xa0xxx")
    assert len(diagnostic.message) < 120
