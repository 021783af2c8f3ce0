"""One mistake, one diagnostic: its consequences are not reported."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import rules_broken

TALKER = "talker: {publishers: {chatter: {type: std_msgs/msg/String, qos: command}}}"
LISTENER = "listener: {subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}}"


def system(*nodes: str, connections: tuple[str, ...] = (), above: str = "") -> str:
    lines = ["system: demo", *([above] if above else []), "nodes:"]
    lines += [f"  {node}" for node in nodes]
    lines += ["connections:"] * bool(connections) + [f"  - {item}" for item in connections]
    return "\n".join(lines) + "\n"


MISTAKES = {
    "a rate with an unknown variable is not known": (
        system(
            "talker: {"
            "publishers: {out: {type: std_msgs/msg/String, qos: command, external: true}}, "
            'timers: {tick: {rate_hz: "${rate}", publish: {out: {data: hello}}}}, '
            "lifecycle: {watch: {topic_silence_ms: 1000}}}",
        ),
        ["unknown-variable"],
    ),
    "what sets the parameters of a node is not known if its name is not": (
        system("motor_${name}: {for_each: {side: [left]}, parameters: {limit: {type: double}}}"),
        ["unknown-variable"],
    ),
    "a parameter file that is missing may set what a node needs": (
        system(
            "motor: {parameters: {limit: {type: double}}, on_activate: {log: started}}",
            above="parameter_files: motor.yaml",
        ),
        ["parameter-file"],
    ),
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
        ["parameter-value"],
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
        ["cycle"],
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
        ["undeclared-name"],
    ),
    "an unknown profile may be the unused one": (
        system(
            "talker: {publishers: {chatter: {type: std_msgs/msg/Empty, qos: fst, external: true}}}",
            above="qos_profiles: {fast: {depth: 1}}",
        ),
        ["undeclared-name"],
    ),
    "an invalid period is not also reported as impractical": (
        system("motor: {timers: {tick: {period_ms: -5, log: tick}}}"),
        ["out-of-range"],
    ),
    "the default of a parameter is wrong, not the values that are like it": (
        system(
            "motor: {parameters: {gains: {type: double, default: [1.0, 2.0]}}, "
            'timers: {tick: {period_ms: 100, log: "{parameters.gains[0]}"}}}'
        ),
        ["parameter-value"],
    ),
    "a value of many copies is one value": (
        system(
            "motor_${i}: {for_each: {i: 5}, "
            'parameters: {index: {type: integer, default: "${i}", maximum: 2}}}'
        ),
        ["parameter-value"],
    ),
    "a publisher of another type does not fill its messages wrongly": (
        system(
            "talker: {publishers: {chatter: {type: std_msgs/msg/Bool, qos: command}}, "
            "timers: {tick: {period_ms: 100, publish: {chatter: {data: hello}}}}}",
            LISTENER,
        ),
        ["type-mismatch"],
    ),
    "a misspelled topic is not also a topic that no node subscribes to": (
        system(
            "talker: {publishers: {chatter: {type: std_msgs/msg/String, qos: command}}, "
            "timers: {tick: {period_ms: 100, publish: {chatter: {data: hello}}}}}",
            "listener: {subscriptions: {chater: {type: std_msgs/msg/String, qos: command}}}",
        ),
        ["subscription-without-publisher"],
    ),
    "a chain in the wrong order has one gap": (
        system(
            "a: {publishers: {out: {type: std_msgs/msg/String, topic: /x, qos: command}}}",
            "b: {subscriptions: {in: {type: std_msgs/msg/String, topic: /x, qos: command, "
            'publish: {out: "{message}"}}}, '
            "publishers: {out: {type: std_msgs/msg/String, topic: /y, qos: command}}}",
            "c: {subscriptions: {in: {type: std_msgs/msg/String, topic: /y, qos: command, "
            'publish: {out: "{message}"}}}, '
            "publishers: {out: {type: std_msgs/msg/String, qos: command, external: true}}}",
            above="chains: {all: {through: [b.out, a.out, c.out], latency_ms: 100}}",
        ),
        ["impossible-chain"],
    ),
    "a node in an unknown process leaves another process without nodes": (
        system(
            "motor: {process: remotes, on_activate: {log: started}}",
            above="processes: {remote: {memory_mb: 100}}",
        ),
        ["undeclared-name"],
    ),
    "discovery of another kind makes several keys useless": (
        system(
            "motor: {on_activate: {log: started}}",
            above="discovery: {kind: peers, address: 10.0.0.5, start: true}",
        ),
        ["invalid-discovery"],
    ),
    "a misspelled key of discovery is not also missing": (
        system(
            "motor: {on_activate: {log: started}}",
            above="discovery: {kind: server, addres: 10.0.0.5}",
        ),
        ["unknown-key"],
    ),
    "a misspelled key of an executable is not also missing": (
        system("motor: {executable: {package: demo_nodes_cpp, nam: talker}}"),
        ["unknown-key"],
    ),
    "misspelled feedback does not make an action a service": (
        system(
            "server: {action_servers: {go: {type: composer_interfaces/action/Navigate, "
            "external: true, feedback: {steps: 3, period_ms: 100}, result: {success: true}}}}"
        ),
        ["unknown-key"],
    ),
    "a connection with an invalid name leaves no client without a server": (
        system(
            "server: {services: {ask: {type: std_srvs/srv/Trigger, respond: {success: true}}}}",
            "user: {clients: {ask: {type: std_srvs/srv/Trigger}}}",
            connections=(
                "{service: 'a b', server: server.ask}",
                "{service: /ask, clients: user.ask}",
            ),
        ),
        ["invalid-name"],
    ),
    "a topic with the endpoints of a service is one mistake": (
        system(
            "server: {services: {ask: {type: std_srvs/srv/Trigger, respond: {success: true}}}}",
            "user: {clients: {ask: {type: std_srvs/srv/Trigger}}}",
            connections=("{topic: /ask, server: server.ask, clients: user.ask}",),
        ),
        ["unknown-key"],
    ),
    "a service with the endpoints of a topic is one mistake": (
        system(
            TALKER,
            LISTENER,
            connections=("{service: /chatter, from: talker.chatter, to: listener.chatter}",),
        ),
        ["unknown-key"],
    ),
    "an invalid namespace separates nodes": (
        system(
            "talker: {publishers: {chatter: {type: std_msgs/msg/String, qos: command}}}",
            "listener: {subscriptions: {in: {type: std_msgs/msg/String, topic: /a/chatter, "
            "qos: command}}}",
            above="namespace: a-b",
        ),
        ["invalid-name"],
    ),
    "a variable of copies that is unknown does not make their names equal": (
        system(
            "motor_${side}: {for_each: {sides: [left, right]}, "
            'on_activate: {log: "started ${side}"}}'
        ),
        ["unknown-variable"],
    ),
    "a node that is unknown in two connections is one mistake": (
        system(
            TALKER,
            "listener: {subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}, "
            "other: {type: std_msgs/msg/String, qos: command}}}",
            connections=(
                "{topic: /chatter, from: talker.chatter, to: listner.chatter}",
                "{topic: /other, to: listner.other}",
            ),
        ),
        ["unknown-node"],
    ),
    "a publisher in place of a subscription is not also connected twice": (
        system(
            TALKER,
            "relay: {publishers: {out: {type: std_msgs/msg/String, qos: command}}}",
            connections=(
                "{topic: /a, from: talker.chatter, to: relay.out}",
                "{topic: /b, from: relay.out}",
            ),
        ),
        ["wrong-port-kind"],
    ),
    "an unknown variable may be the unused one": (
        system(
            'motor: {timers: {tick: {rate_hz: "${start}", log: tick}}}',
            above="variables: {begin: 10}",
        ),
        ["unknown-variable"],
    ),
    "a frame that is its own parent is not also unknown": (
        system(
            "mounts: {transforms: {static: {odom: {parent: odom, translation_m: {x: 1.0}}}}}",
            "viewer: {external: true, transforms: {lookup: [map, odom]}}",
        ),
        ["conflicting-transforms"],
    ),
    "a frame whose parent is now in a cycle is not also unknown": (
        system(
            "mounts: {transforms: {static: {base: {parent: arm, translation_m: {x: 1.0}},"
            " arm: {parent: base, translation_m: {x: 1.0}}}}}",
            "viewer: {external: true, transforms: {lookup: [site]}}",
        ),
        ["conflicting-transforms"],
    ),
    "a variable without a value is not checked": (
        system('motor: {namespace: "${where}", timers: {tick: {rate_hz: "${rate}", log: tick}}}'),
        ["unknown-variable", "unknown-variable"],
    ),
}


@pytest.mark.parametrize(("text", "rules"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_reported_once(text: str, rules: list[str], tmp_path: Path) -> None:
    assert rules_broken(text, tmp_path) == rules
