"""The debugging commands, each as a process of its own, on a hand-written rclpy node."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32

COMPOSE = [sys.executable, "-m", "composer"]
PEER = Path(__file__).with_name("hand_written_talker.py")
PATIENCE_S = 30.0


@pytest.fixture(scope="module", autouse=True)
def peer(shared_domain_id: int) -> Iterator[None]:
    process = subprocess.Popen([sys.executable, str(PEER)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    # Fast DDS may print there first, about what a killed process left behind.
    assert "ready\n" in process.stdout
    yield
    process.kill()
    process.wait()


def compose(*arguments: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [*COMPOSE, *arguments], check=False, capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert done.returncode == code, done.stderr
    return done


def out(*arguments: str) -> str:
    return compose(*arguments).stdout


def start(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*COMPOSE, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def finished(process: subprocess.Popen[str]) -> str:
    """Return what a process that was started has printed, once it has ended well."""
    output, error = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, error
    return output


def listed(parts: tuple[str, ...], *arguments: str) -> str:
    """Ask again until all parts are found: on a busy machine discovery outlasts a command."""
    return asked_until(lambda text: all(part in text for part in parts), *arguments)


def measured(fits: Callable[[dict[str, Any]], bool], *arguments: str) -> dict[str, Any]:
    """Measure again until it fits: what else a machine does changes rates and ages for a while."""
    text = asked_until(lambda text: fits(json.loads(text.splitlines()[-1])), *arguments)
    found: dict[str, Any] = json.loads(text.splitlines()[-1])
    return found


def asked_until(fits: Callable[[str], bool], *arguments: str) -> str:
    """Return the first answer that fits, or the last one there is patience for."""
    until_s = time.monotonic() + PATIENCE_S
    while True:
        text = out(*arguments)
        if fits(text) or time.monotonic() > until_s:
            return text


def error(*arguments: str) -> str:
    done = compose(*arguments, code=1)
    assert done.stdout == ""
    return done.stderr


def test_nodes() -> None:
    assert listed(("/lab/talker",), "node", "list") == "/lab/talker\n"
    assert listed(("1",), "node", "list", "--count") == "1\n"
    assert json.loads(listed(("/lab/talker",), "node", "list", "--json")) == ["/lab/talker"]


def test_a_node_tells_what_it_offers_and_uses() -> None:
    names = ("/lab/count", "/lab/in", "/lab/add", "/lab/navigate")
    found = json.loads(listed(names, "node", "info", "talker", "--json"))
    assert ["/lab/count", ["std_msgs/msg/Int32"]] in found["publishers"]
    assert found["subscriptions"] == [["/lab/in", ["std_msgs/msg/String"]]]
    assert ["/lab/add", ["std_srvs/srv/SetBool"]] in found["services"]
    assert found["action_servers"] == [["/lab/navigate", ["composer_interfaces/action/Navigate"]]]
    assert not any("_action" in name for name, _ in found["services"])
    text = listed(names, "node", "info", "/lab/talker")
    assert "  Action Servers:\n    /lab/navigate:  composer_interfaces/action/Navigate\n" in text


def test_topics() -> None:
    expected = ("/lab/count", "/lab/text", "/lab/in")
    names = listed(expected, "topic", "list").split()
    assert set(expected) <= set(names)
    assert not any("_action" in name for name in names)
    hidden = ("/lab/navigate/_action/feedback",)
    assert hidden[0] in listed(hidden, "topic", "list", "--include-hidden")
    found = json.loads(listed(expected, "topic", "list", "--json"))
    types = {item["name"]: item["types"] for item in found}
    assert types["/lab/count"] == ["std_msgs/msg/Int32"]


def test_a_topic_tells_who_is_at_its_ends_with_which_qos() -> None:
    found = json.loads(listed(("/lab/talker",), "topic", "info", "/lab/text", "--json"))
    assert found["types"] == ["std_msgs/msg/String"]
    assert found["subscriptions"] == []
    assert found["publishers"] == [
        {
            "node": "/lab/talker",
            "type": "std_msgs/msg/String",
            "qos": {
                "reliability": "reliable",
                "durability": "transient_local",
                "liveliness": "automatic",
            },
        }
    ]
    one, kept = "Publisher count: 1\n", "durability: transient_local"
    assert one in listed((one,), "topic", "info", "lab/text")
    assert kept in listed((kept,), "topic", "info", "-v", "/lab/text")


def test_echo_gets_what_a_best_effort_publisher_sends() -> None:
    lines = out("topic", "echo", "/lab/count", "--count", "5", "--json").splitlines()
    values = [json.loads(line)["data"] for line in lines]
    assert values == list(range(values[0], values[0] + 5))


def test_echo_gets_what_was_published_before_and_cuts_it() -> None:
    text = yaml.safe_load(out("topic", "echo", "/lab/text", "--once").removesuffix("---\n"))
    assert text == {"data": "x" * 128 + "..."}
    full = out("topic", "echo", "/lab/text", "--once", "--full-length", "--field", "data")
    assert full == "x" * 200 + "\n---\n"


def test_echo_filters_by_an_expression() -> None:
    condition = "message.data > 20 and message.data < 1000000"
    value = out("topic", "echo", "/lab/count", "--once", "--filter", condition, "--field", "data")
    assert int(value.removesuffix("---\n")) > 20
    assert "has no field 'x'" in error("topic", "echo", "/lab/count", "--filter", "message.x > 1")
    done = compose("topic", "echo", "/lab/count", "--filter", "message.data >", code=2)
    assert done.stderr.startswith("compose: --filter: ")


def test_echo_says_what_is_wrong_with_names_and_fields() -> None:
    assert "did you mean '/lab/count'?" in error("topic", "echo", "/lab/cuont", "--once")
    assert "valid here: data" in error("topic", "echo", "/lab/count", "--once", "--field", "odd")
    silent = ("topic", "echo", "/lab/in", "std_msgs/msg/String", "--timeout", "0.3")
    assert "nothing came over '/lab/in' for 0.3 s" in error(*silent)


def test_echo_ends_quietly_at_ctrl_c() -> None:
    process = start("topic", "echo", "/lab/count")
    assert process.stdout is not None
    assert any(line.startswith("data: ") for line in process.stdout)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert "Traceback" not in err


def test_echo_and_hz_agree_with_a_hand_written_subscriber_to_one_percent() -> None:
    with hand_written_subscriber() as heard:
        # Who starts too late for the first message, or is kept from a processor at the first or
        # the last one, looks at something else than the others: once more, with more time.
        for lead in (150, 300, 600):
            values, seen_s, rate = side_by_side(heard, lead)
            by_hand_hz = (len(seen_s) - 1) / (max(seen_s.values()) - min(seen_s.values()))
            close_hz = pytest.approx(by_hand_hz, rel=0.01)
            if len(seen_s) == len(values) and rate["average_hz"] == close_hz:
                break
    assert len(set(values) & seen_s.keys()) == pytest.approx(len(seen_s), rel=0.01)
    assert len(values) == pytest.approx(len(seen_s), rel=0.01)
    assert rate["window"] == 249
    assert rate["average_hz"] == close_hz


def side_by_side(
    heard: list[tuple[float, int]], lead: int
) -> tuple[list[int], dict[int, float], dict[str, Any]]:
    """Let echo and hz look at the same 250 messages, which begin in ``lead`` messages.

    Returns what echo printed, when each of these was heard by hand, and what hz found.
    """
    first = heard[-1][1] + lead
    since = ("--filter", f"message.data >= {first}", "--count", "250")
    by_echo = start("topic", "echo", "/lab/count", *since, "--field", "data", "--csv")
    by_hz = start("topic", "hz", "/lab/count", *since, "--json")
    rate = json.loads(finished(by_hz).splitlines()[-1])
    values = [int(line) for line in finished(by_echo).splitlines()]
    until_s = time.monotonic() + PATIENCE_S
    while heard[-1][1] < values[-1]:
        assert time.monotonic() < until_s
        time.sleep(0.02)
    seen_s = {value: at_s for at_s, value in tuple(heard) if first <= value <= values[-1]}
    return values, seen_s, rate


@contextmanager
def hand_written_subscriber() -> Iterator[list[tuple[float, int]]]:
    """Yield a list to which a plain subscription adds the time and the number of each message.

    It has begun by then, and its queue is deep enough for a moment without a processor.
    """
    heard: list[tuple[float, int]] = []
    context = rclpy.Context()
    context.init([])
    node = rclpy.create_node("by_hand", context=context)
    node.create_subscription(
        Int32,
        "/lab/count",
        lambda message: heard.append((time.monotonic(), message.data)),
        QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT),
    )
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    try:
        until_s = time.monotonic() + PATIENCE_S
        while not heard:
            assert time.monotonic() < until_s
            time.sleep(0.02)
        yield heard
    finally:
        executor.shutdown()
        thread.join()
        node.destroy_node()
        context.try_shutdown()


def test_hz_tells_people_in_words() -> None:
    assert "average rate: " in out("topic", "hz", "/lab/count", "--count", "10")


def test_bw_counts_serialized_bytes() -> None:
    expected = pytest.approx(8 * 50.0, rel=0.5)  # on a busy machine
    bandwidth = ("topic", "bw", "/lab/count", "--count", "50", "--json")
    found = measured(lambda found: found["bytes_per_s"] == expected, *bandwidth)
    assert (found["smallest"], found["largest"]) == (8, 8)  # header of 4, int32
    assert found["bytes_per_s"] == expected


def test_measuring_looks_at_wanted_messages_only_and_does_not_wait_for_ever() -> None:
    even = ("--filter", "message.data % 2 == 0", "--count", "20", "--json")
    expected = pytest.approx(25.0, rel=0.3)  # of 50 on a busy machine
    rate = ("topic", "hz", "/lab/count", *even)
    found = measured(lambda found: found["average_hz"] == expected, *rate)
    assert found["average_hz"] == expected
    # Of a best-effort publisher a reliable subscription hears nothing. The topic has to be found
    # within the same time.
    silent = ("topic", "bw", "/lab/count", "--qos-reliability", "reliable", "--timeout", "5")
    assert "nothing came over '/lab/count' for 5 s" in error(*silent)


def test_what_is_published_arrives() -> None:
    arguments = ("/lab/in", "std_msgs/msg/String", '{data: "number {count}"}')
    done = compose("topic", "pub", "-r", "20", "--times", "2", "--print", "2", *arguments)
    assert done.stdout == ""
    assert done.stderr == "published #2: std_msgs.msg.String(data='number 1')\n"
    last = "number 1\n---\n"  # the talker may still be at the one before
    echo = ("topic", "echo", "/lab/heard", "--once", "--field", "data")
    assert listed((last,), *echo) == last
    once = ("topic", "pub", "--once", "--json", "--qos-history", "keep_all", *arguments)
    assert json.loads(out(*once)) == {"data": "number 0"}


def test_publishing_says_what_is_wrong() -> None:
    topic = ("topic", "pub", "--once", "/lab/in", "std_msgs/msg/String")
    assert "String has no field 'dta'" in error(*topic, "{dta: hello}")
    assert "takes a text" in error(*topic, "{data: 5}")
    assert "is not a YAML map" in error(*topic, "hello")
    assert "is not installed" in error("topic", "pub", "/lab/in", "std_msgs/msg/Strin")
    nobody = ("topic", "pub", "--once", "/nobody", "std_msgs/msg/String", "--timeout", "0.5")
    assert "0 of 1 subscriptions to '/nobody'" in error(*nobody)


def test_services() -> None:
    assert "/lab/add" in listed(("/lab/add\n",), "service", "list").split()
    assert out("service", "type", "/lab/add") == "std_srvs/srv/SetBool\n"
    assert json.loads(out("service", "type", "/lab/add", "--json")) == ["std_srvs/srv/SetBool"]
    answer = {"success": True, "message": "switched"}
    assert yaml.safe_load(out("service", "call", "/lab/add", "{data: true}")) == answer
    typed = ("service", "call", "/lab/add", "std_srvs/srv/SetBool", "{data: true}", "--json")
    assert json.loads(out(*typed)) == answer
    assert "SetBool_Request has no field 'dta'" in error("service", "call", "/lab/add", "{dta: 1}")
    assert "did you mean '/lab/add'?" in error("service", "call", "/lab/ad", "{data: true}")
    gone = ("service", "call", "/lab/gone", "std_srvs/srv/SetBool", "{}", "--timeout", "0.5")
    assert "did not answer within 0.5 s" in error(*gone)


def test_actions() -> None:
    assert listed(("/lab/navigate",), "action", "list", "-t").split() == [
        "/lab/navigate",
        "composer_interfaces/action/Navigate",
    ]
    info = json.loads(listed(("/lab/talker",), "action", "info", "/lab/navigate", "--json"))
    assert info["servers"] == ["/lab/talker"]


def test_a_goal_gives_feedback_and_a_result() -> None:
    goal = ("action", "send-goal", "/lab/navigate", "{max_velocity: 1.0}", "--feedback", "--json")
    told = [json.loads(line) for line in out(*goal).splitlines()]
    assert [item["feedback"]["progress_percent"] for item in told[:-1]] == [0.0, 1.0, 2.0]
    assert told[-1]["status"] == "succeeded"
    assert told[-1]["result"]["distance_traveled"] == 2.5


def test_feedback_that_comes_together_with_the_result_is_shown() -> None:
    goal = ("action", "send-goal", "/lab/navigate", "{max_velocity: 1.0}", "--feedback", "--json")
    process = start(*goal)
    assert process.stdout is not None
    first = json.loads(next(line for line in process.stdout if "feedback" in line))
    process.send_signal(signal.SIGSTOP)
    time.sleep(0.5)  # the talker tells the rest and ends the goal
    process.send_signal(signal.SIGCONT)
    told = [first, *map(json.loads, process.stdout)]
    finished(process)
    assert [item["feedback"]["progress_percent"] for item in told[:-1]] == [0.0, 1.0, 2.0]
    assert told[-1]["status"] == "succeeded"


def test_a_rejected_goal_is_told() -> None:
    assert "'/lab/navigate' rejected the goal" in error(
        "action", "send_goal", "/lab/navigate", "composer_interfaces/action/Navigate", "{}"
    )


def test_a_goal_that_takes_too_long_is_canceled() -> None:
    goal = ("action", "send-goal", "/lab/navigate", "{max_velocity: -1}", "--json")
    done = compose(*goal, "--result-timeout", "0.3", code=1)
    assert json.loads(done.stdout)["status"] == "canceled"


def test_ctrl_c_cancels_a_goal() -> None:
    goal = ("action", "send-goal", "/lab/navigate", "{max_velocity: -1}", "--feedback", "--json")
    process = start(*goal, "--timeout", "20")
    assert process.stdout is not None
    assert any("feedback" in line for line in process.stdout)
    process.send_signal(signal.SIGINT)
    rest, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    last = json.loads(rest.splitlines()[-1])
    assert (last["status"], last["result"]["message"]) == ("canceled", "stopped")
    assert "canceling" in err
    assert "Traceback" not in err


def test_parameters_are_read_and_set() -> None:
    assert {"speed", "name", "gains"} <= set(out("param", "list", "talker").split())
    assert out("param", "get", "talker", "speed") == "1.5\n"
    assert out("param", "set", "talker", "speed", "2") == "/lab/talker speed: 2.0\n"
    assert json.loads(out("param", "get", "/lab/talker", "speed", "--json")) == 2.0
    assert json.loads(out("param", "set", "talker", "name", "123", "--json")) == {
        "/lab/talker": {"ros__parameters": {"name": "123"}}
    }
    assert json.loads(out("param", "get", "talker", "name", "--json")) == "123"
    out("param", "set", "talker", "gains", "[3, 4.5]")
    assert json.loads(out("param", "get", "talker", "gains", "--json")) == [3.0, 4.5]


def test_a_parameter_that_is_not_taken_is_told_with_the_reason() -> None:
    assert "out of range" in error("param", "set", "talker", "speed", "99")
    assert "'speed' is a double, which 'fast' is not" in error(
        "param", "set", "talker", "speed", "fast"
    )
    assert "did you mean 'speed'?" in error("param", "set", "talker", "sped", "1")
    assert "did you mean '/lab/talker'?" in error("param", "list", "taker")


def test_a_parameter_is_described() -> None:
    assert json.loads(out("param", "describe", "talker", "speed", "--json")) == {
        "name": "speed",
        "type": "double",
        "description": "How fast.",
        "minimum": 0.0,
        "maximum": 5.0,
    }


def test_parameters_of_all_nodes_are_listed_and_several_described() -> None:
    everything = json.loads(listed(("/lab/talker",), "param", "list", "--json"))
    assert {"speed", "name", "gains"} <= set(everything["/lab/talker"])
    head = "/lab/talker:\n"
    assert head in listed((head,), "param", "list")
    several = json.loads(out("param", "describe", "talker", "speed", "name", "--json"))
    assert [item["name"] for item in several] == ["speed", "name"]


def test_what_is_dumped_can_be_loaded(tmp_path: Path) -> None:
    file = tmp_path / "talker.yaml"
    dumped = yaml.safe_load(out("param", "dump", "talker"))
    values = dumped["/lab/talker"]["ros__parameters"]
    assert values["start_type_description_service"] is True  # read-only, as in every ROS node
    values.update(speed=0.25, name="loaded")
    file.write_text(yaml.safe_dump(dumped))
    taken = json.loads(out("param", "load", "talker", str(file), "--json"))
    del values["start_type_description_service"]
    assert taken == dumped
    assert out("param", "get", "talker", "speed") == "0.25\n"


def test_a_parameter_file_may_nest_names_and_use_wildcards(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(
        "/**: {ros__parameters: {speed: 1, for_others: 5}}\n"
        "lab: {talker: {ros__parameters: {limits: {reach: 2}}}}\n"
    )
    assert out("param", "load", "talker", str(file)) == (
        "/lab/talker speed: 1.0\n/lab/talker limits.reach: 2.0\n"
    )
    file.write_text("/other: {ros__parameters: {speed: 1.0}}\n")
    assert "has nothing for /lab/talker" in error("param", "load", "talker", str(file))
    file.write_text("/lab/talker: {speed: 1.0}\n")
    assert "RC043 parameter-file" in error("param", "load", "talker", str(file))
