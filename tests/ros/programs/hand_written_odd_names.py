"""A participant with names that no ROS node can have, as other DDS software may announce them.

Prints ``ready``.
"""

from __future__ import annotations

import time

import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from tests.ros.support.raw_rmw import NodeNames, create, own_prefix

MARKUP = "'\"><img src=x onerror=window.pwned=1>"
TOPICS = ("rt/", "rt/a b", "rt/1st", "rt//twice", "rt/red\x1b[31m", f"rt/{MARKUP}")
SERVICES = (
    *("rq/manager/is_activeRequest", "rq/lab x/manager/is_activeRequest"),
    f"rq/{MARKUP}/manager/is_activeRequest",
)
NODES = (
    *(("/", ""), ("", ""), ("/lab", "with space"), ("/lab/", "end"), ("/lab\x1b[31m", "red")),
    *(("/lab", MARKUP), (f"/{MARKUP}", "node")),
)
PERIOD_S = 0.2


def main() -> None:
    rclpy.init()
    node = Node("ordinary", namespace="lab")
    node.create_publisher(String, "/lab/ordinary", 1)
    for name in TOPICS:
        create(node, String, name)
    for name in SERVICES:
        create(node, Trigger.Request, name, publisher=False)
    names = NodeNames(node, own_prefix(node), [*NODES, ("/lab", "ordinary")])
    print("ready", flush=True)
    while True:
        names.announce()
        time.sleep(PERIOD_S)


if __name__ == "__main__":
    main()
