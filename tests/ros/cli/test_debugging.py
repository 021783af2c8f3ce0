"""The commands for nodes and topics, with a plain rclpy node in another process."""

from __future__ import annotations

import json
import re
import signal
import time
from typing import Any

import pytest
import yaml
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32

from tests.ros.support.commands import (
    PATIENCE_S,
    expect_errors,
    finished,
    listed,
    measured,
    repeated,
    repeated_until,
    start,
)
from tests.ros.support.in_process import Peer, wait_until

pytestmark = pytest.mark.usefixtures("talker")


def test_nodes_and_topics() -> None:
    assert listed(("/lab/talker",), "node", "list") == "/lab/talker\n"
    assert json.loads(listed(("/lab/talker",), "node", "list", "--json")) == ["/lab/talker"]
    names = ("/lab/count", "/lab/in", "/lab/add", "/lab/navigate")
    info = json.loads(listed(names, "node", "info", "talker", "--json"))
    assert ["/lab/count", ["std_msgs/msg/Int32"]] in info["publishers"]
    assert info["subscriptions"] == [["/lab/in", ["std_msgs/msg/String"]]]
    assert ["/lab/add", ["std_srvs/srv/SetBool"]] in info["services"]
    assert info["action_servers"] == [["/lab/navigate", ["composer_interfaces/action/Navigate"]]]
    assert not any("_action" in name for name, _ in info["services"])
    text = listed(names, "node", "info", "/lab/talker")
    assert "  Action Servers:\n    /lab/navigate:  composer_interfaces/action/Navigate\n" in text

    topics = ("/lab/count", "/lab/text", "/lab/in")
    shown = listed(topics, "topic", "list").split()
    assert set(topics) <= set(shown)
    assert not any("_action" in name for name in shown)
    listed(("/lab/navigate/_action/feedback",), "topic", "list", "--all")
    found = json.loads(listed(topics, "topic", "list", "--json"))
    types = {item["name"]: item["types"] for item in found}
    assert types["/lab/count"] == ["std_msgs/msg/Int32"]


def test_topic_info() -> None:
    described = ("topic", "info", "/lab/text", "--json")
    # A command of another test may still be there.
    text = repeated_until(
        lambda text: "/lab/talker" in text and not json.loads(text)["subscriptions"], *described
    )
    found = json.loads(text)
    assert found["types"] == ["std_msgs/msg/String"]
    assert found["subscriptions"] == []
    (publisher,) = found["publishers"]
    assert re.fullmatch(r"([0-9a-f]{2}\.){15}[0-9a-f]{2}", publisher.pop("gid"))
    assert re.fullmatch(r"RIHS01_[0-9a-f]{64}", publisher.pop("type_hash"))
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
    listed((one,), "topic", "info", "lab/text")
    listed((kept,), "topic", "info", "-v", "/lab/text")


def test_echo_receives_messages_of_all_kinds_and_filters_them() -> None:
    count, text = ("topic", "echo", "/lab/count"), ("topic", "echo", "/lab/text", "--once")
    # From a best-effort publisher.
    lines = listed(("data",), *count, "--count", "5", "--json").splitlines()
    values = [json.loads(line)["data"] for line in lines]
    assert values == list(range(values[0], values[0] + 5))
    # Earlier messages, truncated.
    shown = yaml.safe_load(listed(("data",), *text).removesuffix("---\n"))
    assert shown == {"data": "x" * 128 + "..."}
    full = listed(("x",), *text, "--full-length", "--field", "data")
    assert full == "x" * 200 + "\n---\n"
    condition = "message.data > 20 and message.data < 1000000"
    value = listed(("---\n",), *count, "--once", "--field", "data", "--filter", condition)
    assert int(value.removesuffix("---\n")) > 20
    done = repeated(lambda done: done.returncode == 2, *count, "--filter", "message.data >")
    assert done.stderr.startswith("compose: --filter: ")


def test_echo_reports_unknown_names_and_fields() -> None:
    echo = ("topic", "echo")
    silent = "no message received on '/lab/in' for 0.3 s"
    expect_errors(
        ("did you mean '/lab/count'?", *echo, "/lab/cuont", "--once"),
        ("valid here: data", *echo, "/lab/count", "--once", "--field", "odd"),
        ("has no field 'x'", *echo, "/lab/count", "--filter", "message.x > 1"),
        (silent, *echo, "/lab/in", "std_msgs/msg/String", "--timeout", "0.3"),
    )


def test_echo_ends_quietly_at_ctrl_c() -> None:
    process = start("topic", "echo", "/lab/count", "std_msgs/msg/Int32")
    assert process.stdout is not None
    assert any(line.startswith("data: ") for line in process.stdout)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert "Traceback" not in err


@pytest.mark.timeout(240)
def test_echo_and_hz_agree_with_a_plain_subscription(peer: Peer) -> None:
    received: list[tuple[float, int]] = []  # the time and the number of each message
    peer.node.create_subscription(
        Int32,
        "/lab/count",
        lambda message: received.append((time.monotonic(), message.data)),
        QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT),  # for a busy machine
    )
    wait_until(lambda: received, "a message")
    # A process that starts after the first message, or is not scheduled during the first or last
    # one, sees other messages: try again with more time.
    for lead in (150, 300, 600, 600, 600, 600):
        values, seen_s, rate = side_by_side(received, lead)
        by_hand_hz = (len(seen_s) - 1) / (max(seen_s.values()) - min(seen_s.values()))
        close_hz = pytest.approx(by_hand_hz, rel=0.01)
        if len(seen_s) == len(values) and rate["average_hz"] == close_hz:
            break
    assert len(set(values) & seen_s.keys()) == pytest.approx(len(seen_s), rel=0.01)
    assert len(values) == pytest.approx(len(seen_s), rel=0.01)
    assert rate["window"] == 249
    assert rate["average_hz"] == close_hz


def side_by_side(
    received: list[tuple[float, int]], lead: int
) -> tuple[list[int], dict[int, float], dict[str, Any]]:
    """Run echo and hz on the same 250 messages, starting ``lead`` messages from now.

    Returns the values that echo printed, when the subscription received each of them, and the
    rate that hz measured.
    """
    first = received[-1][1] + lead
    since = ("--filter", f"message.data >= {first}", "--count", "250")
    by_echo = start("topic", "echo", "/lab/count", *since, "--field", "data", "--json")
    by_hz = start("topic", "hz", "/lab/count", *since, "--json")
    rate = json.loads(finished(by_hz).splitlines()[-1])
    values = [int(line) for line in finished(by_echo).splitlines()]
    wait_until(lambda: received[-1][1] >= values[-1], "the last value")
    seen_s = {value: at_s for at_s, value in tuple(received) if first <= value <= values[-1]}
    return values, seen_s, rate


def test_rates_are_measured_filtered_and_time_out() -> None:
    rate = ("topic", "hz", "/lab/count")
    listed(("average rate: ",), *rate, "--count", "10")
    too_few = "too few messages on '/lab/count' to measure them yet"
    repeated(lambda done: too_few in done.stderr, *rate, "--count", "2")
    even = ("--filter", "message.data % 2 == 0", "--count", "20", "--json")
    expected = pytest.approx(25.0, rel=0.3)  # of 50 on a busy machine
    found = measured(lambda found: found["average_hz"] == expected, *rate, *even)
    assert found["average_hz"] == expected
    # A reliable subscription receives nothing from a best-effort publisher. The limit also applies
    # to the discovery of the topic.
    silent = (*rate, "--qos-reliability", "reliable", "--timeout", "5")
    # Latched messages from before are not measured; a report would be printed after a second.
    latched = ("topic", "hz", "/lab/text", "--timeout", "5")
    none = "no message received on '/lab/{}' for 5 s"
    expect_errors((none.format("count"), *silent), (none.format("text"), *latched))


def test_published_messages_arrive() -> None:
    arguments = ("/lab/in", "std_msgs/msg/String", '{data: "number {count}"}')
    twice = ("topic", "pub", "-r", "20", "--times", "2", *arguments)
    expected = "".join(
        f"published #{number + 1}: std_msgs.msg.String(data='number {number}')\n"
        for number in range(2)
    )
    # There is a warning if the talker does not acknowledge the messages within a second.
    done = repeated(lambda done: done.stderr == expected, *twice)
    assert (done.returncode, done.stdout) == (0, "")
    last = "number 1\n---\n"  # the talker may still publish the one before
    echo = ("topic", "echo", "/lab/received", "--once", "--field", "data")
    assert listed((last,), *echo) == last
    once = ("topic", "pub", "--once", "--json", "--qos-depth", "5", *arguments)
    assert json.loads(listed(("number 0",), *once)) == {"data": "number 0"}


def test_publishing_reports_errors() -> None:
    topic = ("topic", "pub", "--once", "/lab/in", "std_msgs/msg/String")
    unused = ("topic", "pub", "--once", "/unused", "std_msgs/msg/String", "--timeout", "0.5")
    expect_errors(
        ("String has no field 'dta'", *topic, "{dta: hello}"),
        ("takes a string", *topic, "{data: 5}"),
        ("is not a YAML map", *topic, "hello"),
        ("found 0 of 1 subscriptions to '/unused'", *unused),
    )
