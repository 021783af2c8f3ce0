"""With the default profile, Fast DDS wakes no extra thread for each message."""

from __future__ import annotations

import json
import subprocess

from std_msgs.msg import String

from tests.ros.support.commands import PYTHON
from tests.ros.support.in_process import Peer

MESSAGES = 4000
#: Publish to another process, and print how often the timer thread of Fast DDS slept meanwhile.
PUBLISH = f"""
import json, os, sys, time
from pathlib import Path
from composer.runtime.middleware.environment import prepare_environment
prepare_environment()
import rclpy
from std_msgs.msg import String

def sleeps():
    tasks = [task for task in Path("/proc/self/task").iterdir()
             if (task / "comm").read_text().startswith("dds.ev")]
    assert len(tasks) == 1, tasks
    status = dict(line.split(":", 1) for line in (tasks[0] / "status").read_text().splitlines())
    return int(status["voluntary_ctxt_switches"])

rclpy.init()
node = rclpy.create_node("publisher")
publisher = node.create_publisher(String, sys.argv[1], 10)
until_s = time.monotonic() + 30.0
while not publisher.get_subscription_count():
    assert time.monotonic() < until_s, "no subscription"
    time.sleep(0.01)  # poll
before, began_s = sleeps(), time.monotonic()
for number in range({MESSAGES}):
    publisher.publish(String(data=str(number)))
    next_s = time.monotonic() + 0.0002
    while time.monotonic() < next_s:
        pass
print(json.dumps([sleeps() - before, time.monotonic() - began_s]), flush=True)
os._exit(0)
"""


def test_no_thread_wakes_after_each_message(peer: Peer) -> None:
    received: list[String] = []
    peer.node.create_subscription(String, "/texts", received.append, 10)
    done = subprocess.run(
        [*PYTHON, "-c", PUBLISH, "/texts"],
        check=True,
        capture_output=True,
        text=True,
        timeout=60.0,
    )
    assert received
    assert "XML" not in done.stderr + done.stdout  # printed if the profile is invalid
    slept, took_s = json.loads(done.stdout.splitlines()[-1])
    # A few times in 4 ms; by default twice for each of the 5000 messages in a second.
    assert 0 < slept < 2000.0 * took_s
