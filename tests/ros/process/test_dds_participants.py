"""Our processes are met at once, and know when somebody is left to be met."""

from __future__ import annotations

import json
import os
import subprocess
import time
from pathlib import Path

from std_msgs.msg import Empty

from composer.runtime.process.dds_participants import count_participants
from tests.ros.support.commands import PYTHON
from tests.ros.support.in_process import Peer, wait_until

#: Who is not met at once is met 1 to 3 s later; without the profile that is every second one. So
#: many joins and such a share tell that from a machine that stood still during some of them.
JOINS, ENOUGH = 16, 12
AT_ONCE_S = 0.9
#: Their lease is 4 s, others have 20 s.
FORGOTTEN_WITHIN_S = 10.0
#: Enough to come in several packets.
TOPICS = [f"/flood/topic_{number}" for number in range(250)]
JOIN = f"""
import json, time
from composer.runtime.process.environment import prepare_environment
prepare_environment()
from composer.remote.graph_names import Names
from composer.remote.session import Deadline, Session

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
#: What a command has open: UDP ports, and shared memory of Fast DDS.
LOOK = """
import json, os, re
from pathlib import Path
from composer.runtime.process.environment import prepare_environment
prepare_environment()
from composer.remote.session import Deadline, Session, use_command_profile

use_command_profile()
with Session() as session:
    session.wait_for(lambda: session.others() or None, Deadline(10.0))
    sockets = {os.readlink(path) for path in Path("/proc/self/fd").iterdir() if path.is_socket()}
    rows = [row.split() for row in Path("/proc/net/udp").read_text().splitlines()[1:]]
    ports = [int(row[1].rpartition(":")[2], 16) for row in rows if f"socket:[{row[9]}]" in sockets]
    shared = re.findall("/dev/shm/fast.*", Path("/proc/self/maps").read_text())
    print(json.dumps([session.others(), ports, shared]))
"""


def test_the_nodes_of_tests_keep_out_of_shared_memory(peer: Peer) -> None:
    """Beside a process that was killed they would crash or hang now and then when destroyed."""
    assert peer.node.get_node_names()
    assert "/dev/shm/fast" not in Path("/proc/self/maps").read_text(encoding="utf-8")


def test_a_process_that_joins_is_met_at_once_with_all_its_topics(peer: Peer) -> None:
    for topic in TOPICS:
        peer.node.create_publisher(Empty, topic, 1)
    done = subprocess.run(
        [*PYTHON, "-c", JOIN], check=True, capture_output=True, text=True, timeout=50.0
    )
    assert "XML" not in done.stderr + done.stdout  # Fast DDS says so if it cannot read the profile
    took_s, missing = json.loads(done.stdout.splitlines()[-1])
    assert sum(join_s < AT_ONCE_S for join_s in took_s) >= ENOUGH, took_s
    assert missing.count(0) >= ENOUGH, missing


def test_each_participant_on_this_computer_is_counted(peer: Peer) -> None:
    domain_id = int(os.environ["ROS_DOMAIN_ID"])
    before = count_participants(domain_id)
    assert before >= 1
    another = Peer()
    try:
        assert count_participants(domain_id) == before + 1
    finally:
        another.close()
    wait_until(lambda: count_participants(domain_id) == before, "it left")


def test_a_command_meets_others_without_shared_memory_and_stays_on_this_computer(
    peer: Peer,
) -> None:
    done = subprocess.run(
        [*PYTHON, "-c", LOOK], check=True, capture_output=True, text=True, timeout=50.0
    )
    others, ports, shared = json.loads(done.stdout.splitlines()[-1])
    assert [peer.node.get_name(), peer.node.get_namespace()] in others
    assert shared == []
    multicast = 7400 + 250 * int(os.environ["ROS_DOMAIN_ID"])
    assert ports
    assert multicast not in ports


def test_a_command_is_soon_forgotten(peer: Peer) -> None:
    def participants() -> int:
        return len(peer.node.get_publishers_info_by_topic("ros_discovery_info", no_mangle=True))

    before = participants()
    for _ in range(3):  # most of their goodbyes are lost
        subprocess.run([*PYTHON, "-c", LOOK], check=True, capture_output=True, timeout=50.0)
    ended_s = time.monotonic()
    wait_until(lambda: participants() <= before, "they are gone")
    assert time.monotonic() - ended_s < FORGOTTEN_WITHIN_S
