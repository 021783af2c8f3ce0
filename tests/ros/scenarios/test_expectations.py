"""What each kind of expectation accepts and reports, and what each step does."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.scenarios.runner import Result
from tests.ros.scenarios.conftest import run

#: Counts at 10 Hz from 0.1 s on, doubles the numbers, answers and drives.
SYSTEM = """\
system: counting
nodes:
  counter:
    parameters: {step: {type: integer, default: 1}}
    publishers: {count: {type: std_msgs/msg/Int32, external: true}}
    timers:
      tick: {rate_hz: 10, publish: {count: {data: "{count * parameters.step}"}}}
    on_activate: {log: counting}
  doubler:
    lifecycle: {depends_on: [counter], on_failure: restart, restart: {backoff_ms: 500}}
    subscriptions:
      numbers:
        type: std_msgs/msg/Int32
        publish: {sums: {data: "{message.data * 2}"}}
        log: {level: warn, message: "got {message.data}"}
    publishers: {sums: {type: std_msgs/msg/Int32, external: true}}
    services: {reset: {type: std_srvs/srv/Trigger, respond: {success: true}}}
    action_servers:
      drive:
        type: composer_interfaces/action/Navigate
        accept: goal.max_velocity > 0.0
        feedback: {count: 2, period_ms: 500}
        result: {success: true, message: arrived}
connections:
  - {topic: /count, from: counter.count, to: doubler.numbers}
  - {topic: /sums, from: doubler.sums}
  - {service: /reset, server: doubler.reset}
  - {action: /drive, server: doubler.drive}
chains:
  doubled: {through: [counter.count, doubler.sums], latency_ms: 50}
"""


def scenario(folder: Path, text: str) -> Path:
    (folder / "counting.yaml").write_text(SYSTEM)
    path = folder / "scenario.yaml"
    path.write_text(f"scenario: s\nsystem: ./counting.yaml\n{text}")
    return path


#: Expectations, and what is seen if they are not met.
EXPECTATIONS = {
    "{message: /count}": "",
    "{message: /count, within_s: 0.05}": "none; the next one at 0.1 s",
    "{message: /count, where: message.data == 7, after_s: 0.75, within_s: 0.85}": "",
    "{message: /count, where: message.data == 7, within_s: 0.5}": (
        "none; the last message, at 0.5 s: message.data is 4; the next one at 0.8 s"
    ),
    "{message: /count, where: message.data < 0}": (
        "none; the last message, at 3 s: message.data is 29"
    ),
    "{message: /count, where: 1 / message.data > 2, within_s: 0.15}": (
        "none; the last message, at 0.1 s: '1 / message.data': division by zero"
    ),
    "{message: /count, fields: {data: 7}, tolerance: 1, at_least: 3, at_most: 3}": "",
    "{message: /count, fields: {data: -7}, tolerance: 1}": (
        "none; the last message, at 3 s: data is 29, not -7"
    ),
    "{message: /count, at_least: 32}": "31, at 0.1 s, 0.2 s, 0.3 s, 0.4 s, 0.5 s, ...",
    "{message: /sums, where: message.data == 2, at_most: 1}": "",
    "{rate: /count, at_least_hz: 9.9, at_most_hz: 10.1, for_s: 0.9}": "",
    "{rate: /count, at_least_hz: 11, after_s: 1.5, for_s: 1}": "10 Hz, 10 messages in 1 s",
    "{silence: /count, where: message.data > 5, for_s: 0.5}": "",
    "{silence: /count, after_s: 1.05, for_s: 0.1}": "1, at 1.1 s",
    "{order: [{state: {counter: active}}, {state: {doubler: active}}, {message: /sums}]}": "",
    "{order: [{state: {doubler: active}}, {state: {counter: active}}]}": (
        "after doubler active at 0 s, no counter active, only before, at 0 s"
    ),
    "{log: counting, node: counter}": "",
    "{log: counting, node: doubler}": "none; the last line, at 3 s: [WARN] got 29",
    "{log: got 400, level: warn, at_most: 1}": "",
    "{log: got 400, level: info}": "none; the last line, at 3 s: [WARN] got 29",
    "{state: {counter: active, doubler: active}, within_s: 0.1}": "",
    "{state: {counter: inactive}, after_s: 0.1}": "counter active at 3.05 s",
    "{end_state: {counter: active}}": "",
    "{end_state: {doubler: unconfigured}}": "doubler active",
    "{response: /reset, where: response.success}": "",
    "{response: /reset, where: not response.success}": (
        "none; the last response, at 1 s: response.success is True"
    ),
    "{result: /drive, where: status == 'succeeded', fields: {message: arrived}}": "",
    "{result: /drive, where: status == 'rejected', at_least: 1, at_most: 1}": "",
    "{latency: doubled}": "",
}


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What is seen in one run, by the expectations that are not met."""
    text = """\
for_s: 3.05
steps:
  - at_s: 1
    publish: {/count: {data: 400}}
    call: {/reset: {}}
    send_goal: {/drive: {max_velocity: 1.0}}
  - send_goal: {/drive: {}}
expect:
"""
    items = "".join(f"  - {item}\n" for item in EXPECTATIONS)
    path = scenario(tmp_path_factory.mktemp("counting"), text + items)
    lines = path.read_text().splitlines()
    failures = run(path).failures
    return {lines[item.span.line - 1].removeprefix("  - "): item.seen for item in failures}


@pytest.mark.parametrize("expectation", EXPECTATIONS)
def test_expectation(expectation: str, seen: dict[str, str]) -> None:
    assert seen.get(expectation, "") == EXPECTATIONS[expectation]


#: Steps, each with expectations that hold because of it, and do not hold otherwise.
STEPS = [
    "publish: {/count: {data: 400}}, expect: [{message: /sums, fields: {data: 800}}]",
    "set_parameter: {counter.step: 5000}, expect: [{message: /sums, where: message.data > 9999}]",
    "transition: {doubler: deactivate}, expect: [{silence: /sums}]",
    "drop: {/count: {count: 2}}, expect: [{silence: /sums, for_s: 0.2}, {message: /sums}]",
    "drop: {/count: {for_s: 0.5}}, expect: [{silence: /sums, for_s: 0.45}, {message: /sums}]",
    "delay: {/count: {by_s: 0.05, count: 1}}, expect: [{message: /sums, where: now % 0.1 > 0.04}]",
    "drop: {/count: {skip: 1, count: 1}}, expect: [{message: /sums, within_s: 0.1},"
    " {silence: /sums, after_s: 0.1, for_s: 0.1}]",
    "delay_timer: {counter.tick: {by_s: 0.05, skip: 1, count: 1}},"
    " expect: [{message: /count, where: now % 0.1 > 0.04, after_s: 0.1, within_s: 0.2}]",
    "duplicate: {/count: {count: 1}}, expect: [{message: /sums, within_s: 0.15, at_least: 2}]",
    "reorder: {/count: {count: 2}}, expect: [{order: [{log: got 10}, {log: got 9}]}]",
    'corrupt: {/count: {set: {data: "{message.data + 900}"}}}, expect: [{log: got 909}]',
    "kill: doubler, expect: [{state: {doubler: unconfigured}}, {state: {doubler: active}}]",
    "send_goal: {/drive: {max_velocity: 1.0}}, expect: [{result: /drive, after_s: 0.9}]",
]


@pytest.mark.parametrize("step", STEPS)
def test_step(step: str, tmp_path: Path) -> None:
    result = run(scenario(tmp_path, f"for_s: 2.5\nsteps: [{{at_s: 0.95, {step}}}]\n"))
    assert [(item.expected, item.seen) for item in result.failures] == []


def _in_pipeline(project: Path, text: str) -> Result:
    path = project / "scenarios" / "test.yaml"
    path.write_text(f"scenario: test\nsystem: pipeline\nfor_s: 3\n{text}")
    return run(path)


@pytest.mark.parametrize(
    "text",
    [
        "steps: [{raise_in: {planner: {handler: on_sensor_data, error: no memory}}}]\n"
        "expect: [{log: no memory, node: planner, within_s: 0.1}]",
        "steps: [{raise_in: {planner: {}}}]\nallow_errors: true",
        "steps: [{at_s: 1, hang: {motor_controller: {for_s: 2.0}},"
        " expect: [{silence: /motor_commands, after_s: 0.1, for_s: 1.8}]}]",
        "overrides: {nodes: {planner: {lifecycle: {on_failure: isolate}}}}\n"
        "steps: [{at_s: 1, kill: planner}]\nexit_code: 1",
    ],
)
def test_faults_of_nodes(text: str, project: Path) -> None:
    result = _in_pipeline(project, text)
    assert [(item.expected, item.seen) for item in result.failures] == []


@pytest.mark.parametrize(
    ("text", "expected", "seen"),
    [
        ("steps: [{raise_in: {planner: {}}}]", "no errors in the log", "RuntimeError: injected"),
        ("exit_code: 1", "exit code 1", "0: end of the test"),
        (
            "steps: [{when: {message: /motor_commands, where: message.linear.x > 9}}]",
            "a message on /motor_commands where message.linear.x > 9, for the next step",
            "none until the end of the run; the last message, at",
        ),
        (
            "steps: [{transition: {planner: cleanup}}]",
            "'transition' to work",
            "'cleanup' of planner failed",
        ),
    ],
)
def test_what_else_fails_a_scenario(text: str, expected: str, seen: str, project: Path) -> None:
    [failure] = _in_pipeline(project, text).failures
    assert failure.expected == expected
    assert seen in failure.seen
