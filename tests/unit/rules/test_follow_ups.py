"""One mistake, one diagnostic: its consequences are not reported."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load
from tests.unit.support.checking import rules_broken

TALKER = "talker: {publishers: {chatter: {type: std_msgs/msg/String, qos: command}}}"
LISTENER = "listener: {subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}}"


def system(*nodes: str, connections: tuple[str, ...] = (), above: str = "") -> str:
    lines = ["system: demo", *([above] if above else []), "nodes:"]
    lines += [f"  {node}" for node in nodes]
    lines += ["connections:"] * bool(connections) + [f"  - {item}" for item in connections]
    return "\n".join(lines) + "\n"


MISTAKES = {
    "a node of an unknown type may publish what another one subscribes to": (
        system("talker: {type: tlker}", LISTENER),
        ["unknown-node-type"],
    ),
    "the intended port of a misspelled reference is not unheard": (
        system(
            TALKER,
            LISTENER,
            connections=("{topic: /a, from: talker.chater, to: listener.chatter}",),
        ),
        ["unknown-port"],
    ),
    "the port of a misspelled node is not unheard": (
        system(
            TALKER,
            LISTENER,
            connections=("{topic: /a, from: talkr.chatter, to: listener.chatter}",),
        ),
        ["unknown-node"],
    ),
    "a misspelled section hides its ports": (
        system(
            "talker: {publisher: {chatter: {type: std_msgs/msg/String, qos: command}}, "
            "timers: {tick: {period_ms: 100, publish: {chatter: {data: hello}}}}}",
            LISTENER,
            connections=("{topic: /a, from: talker.chatter, to: listener.chatter}",),
        ),
        ["unknown-key"],
    ),
    "a misspelled section hides its parameters": (
        system(
            "motor: {paramters: {rate_hz: 10.0}, "
            'timers: {tick: {rate_hz: "{parameters.rate_hz}", log: tick}}}'
        ),
        ["unknown-key"],
    ),
    "a misspelled section hides its state": (
        system(
            "motor: {stat: {last: 0.0}, timers: {tick: {period_ms: 100, set: {last: 1.0}, "
            "when: state.last < 1.0}}}"
        ),
        ["unknown-key"],
    ),
    "a misspelled reaction does not make its timer idle": (
        system("motor: {timers: {tick: {period_ms: 100, lgo: hello}}}"),
        ["unknown-key"],
    ),
    "a misspelled policy makes the profile unknown": (
        system(
            "talker: {publishers: {chatter: {type: std_msgs/msg/String, "
            "qos: {reliabilty: reliable, durability: transient_local}}}}",
            "listener: {subscriptions: {chatter: {type: std_msgs/msg/String, qos: state}}}",
        ),
        ["unknown-key"],
    ),
    "an unknown type is not compared with others": (
        system(
            TALKER, "listener: {subscriptions: {chatter: {type: std_msgs/msg/Strin, qos: command}}}"
        ),
        ["unknown-interface"],
    ),
    "endpoints of different types need not have compatible QoS": (
        system(
            TALKER, "listener: {subscriptions: {chatter: {type: std_msgs/msg/Bool, qos: state}}}"
        ),
        ["type-mismatch"],
    ),
    "a value of the wrong type is not out of range as well": (
        system(
            "motor: {parameters: {speed: {type: double, default: fast, maximum: 5.0, "
            "choices: [1.0, 2.0]}}}"
        ),
        ["parameter-type"],
    ),
    "a range that no value can satisfy is one mistake": (
        system(
            "motor: {parameters: {speed: {type: double, default: 3.0, minimum: 5, maximum: 1}}}"
        ),
        ["parameter-declaration"],
    ),
    "an unknown name has no fields": (
        system(
            "listener: {subscriptions: {chatter: {type: std_msgs/msg/String, qos: command, "
            'external: true, log: "{mesage.data.x}"}}}'
        ),
        ["unknown-name"],
    ),
    "a timer with an invalid expression is not idle": (
        system('motor: {timers: {tick: {period_ms: 100, log: "{1 +}"}}}'),
        ["invalid-expression"],
    ),
    "a cycle is not also reported as the wrong order": (
        system(
            "a: {clients: {ask: {type: std_srvs/srv/Trigger}}, lifecycle: {depends_on: [b]}}",
            "b: {services: {ask: {type: std_srvs/srv/Trigger, respond: {success: true}}}, "
            "lifecycle: {depends_on: [a]}}",
        ),
        ["dependency-cycle"],
    ),
    "a remapping of an unknown name may be meant for an unconnected port": (
        system(
            "talker: {publishers: {words: {type: std_msgs/msg/String, qos: command}}, "
            "remappings: {word: chatter}}",
            LISTENER,
        ),
        ["unknown-remapping"],
    ),
    "an unknown executor may be the unused one": (
        system(
            "motor: {executor: contrl, on_activate: {log: started}}",
            above="executors: {control: {kind: single_threaded}}",
        ),
        ["unknown-executor"],
    ),
    "an unknown profile may be the unused one": (
        system(
            "talker: {publishers: {chatter: {type: std_msgs/msg/Empty, qos: fst, external: true}}}",
            above="qos_profiles: {fast: {depth: 1}}",
        ),
        ["unknown-qos-profile"],
    ),
    "an invalid period is not also reported as impractical": (
        system("motor: {timers: {tick: {period_ms: -5, log: tick}}}"),
        ["out-of-range"],
    ),
    "a variable without a value is not checked": (
        system('motor: {namespace: "${where}", timers: {tick: {rate_hz: "${rate}", log: tick}}}'),
        ["unknown-variable", "unknown-variable"],
    ),
}


@pytest.mark.parametrize(("text", "rules"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_reported_once(text: str, rules: list[str], tmp_path: Path) -> None:
    assert rules_broken(text, tmp_path) == rules


def test_a_mistake_in_a_node_type_is_reported_once_for_all_instances(tmp_path: Path) -> None:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "talker.yaml").write_text(
        "node: talker\n"
        "publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}\n"
        "timers: {tick: {period_ms: 100, publish: {chatter: {dat: hello}}}}\n",
        encoding="utf-8",
    )
    text = system("a: {type: talker}", "b: {type: talker}", "c: {type: talker, namespace: left}")
    assert rules_broken(text, tmp_path) == ["unknown-field"]


def test_a_node_type_alone_needs_no_connections(tmp_path: Path) -> None:
    text = (
        "node: relay\nvariables: {message_type: {description: The type.}}\n"
        "parameters: {rate_hz: {type: double}}\n"
        "subscriptions:\n"
        "  input: {type: '${message_type}', qos: command, publish: {output: '{message}'}}\n"
        "publishers: {output: {type: '${message_type}', qos: command}}\n"
    )
    path = tmp_path / "relay.yaml"
    path.write_text(text, encoding="utf-8")
    assert load(path).diagnostics == []
