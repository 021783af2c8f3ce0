"""What may be meant by the name of an interface that is not there."""

from __future__ import annotations

import pytest

from composer.interfaces.index import similar_interface

KNOWN = (
    "nav_msgs/msg/Odometry",
    "std_msgs/msg/Empty",
    "std_msgs/msg/String",
    "std_srvs/srv/Empty",
)


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("std_msgs/msg/Strin", "did you mean 'std_msgs/msg/String'?"),
        ("std_msgs/String", "did you mean 'std_msgs/msg/String'?"),
        ("String", "did you mean 'std_msgs/msg/String'?"),
        ("odometri", "did you mean 'nav_msgs/msg/Odometry'?"),
        ("nav_msg/msg/Odometry", "did you mean 'nav_msgs/msg/Odometry'?"),
        ("Empty", "valid here: std_msgs/msg/Empty, std_srvs/srv/Empty"),
        ("std_msgs/msg/Odometry", "did you mean 'nav_msgs/msg/Odometry'?"),
        ("std_msgs/msg/Quaternion", "valid here: std_msgs/msg/Empty, std_msgs/msg/String"),
        ("acme/msg/Tile", None),
        ("Xyzzy", None),
        ("", None),
    ],
)
def test_the_nearest_is_found_by_package_and_name(name: str, hint: str | None) -> None:
    assert similar_interface(name, KNOWN) == hint
