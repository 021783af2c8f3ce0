"""Our processes are met at once, and know when somebody is left to be met."""

from __future__ import annotations

import json
import os
import subprocess
import sys

from std_msgs.msg import Empty

from composer.runtime.participants import participants_here
from tests.ros.system_bench import Peer, wait_until

JOINS = 8
#: Who is not met at once is met 1 to 3 s later; without the profile that is every second one.
AT_ONCE_S = 0.7
#: Enough to come in several packets.
TOPICS = [f"/flood/topic_{number}" for number in range(250)]
JOIN = f"""
import json, time
from composer.runtime.environment import prepare_environment
prepare_environment()
from composer.runtime.inspect_names import Names
from composer.runtime.session import Deadline, Session

took_s, missing = [], []
for _ in range({JOINS}):
    with Session() as session:
        began_s = time.monotonic()
        session.wait_for(lambda: session.others() or None, Deadline(10.0))
        took_s.append(time.monotonic() - began_s)
        found = dict(Names(session, Deadline(10.0)).topics())
        missing.append(sum(topic not in found for topic in {TOPICS}))
print(json.dumps([took_s, missing]))
"""


def test_a_process_that_joins_is_met_at_once_with_all_its_topics(peer: Peer) -> None:
    for topic in TOPICS:
        peer.node.create_publisher(Empty, topic, 1)
    done = subprocess.run(
        [sys.executable, "-c", JOIN], check=True, capture_output=True, text=True, timeout=50.0
    )
    assert "XML" not in done.stderr + done.stdout  # Fast DDS says so if it cannot read the profile
    took_s, missing = json.loads(done.stdout.splitlines()[-1])
    assert sum(join_s < AT_ONCE_S for join_s in took_s) >= JOINS * 0.8, took_s
    assert missing.count(0) >= JOINS * 0.8, missing


def test_each_participant_on_this_computer_is_counted(peer: Peer) -> None:
    domain_id = int(os.environ["ROS_DOMAIN_ID"])
    before = participants_here(domain_id)
    assert before >= 1
    another = Peer()
    try:
        assert participants_here(domain_id) == before + 1
    finally:
        another.close()
    wait_until(lambda: participants_here(domain_id) == before, "it left")
