"""The nodes that depend on those of a lifecycle request."""

from __future__ import annotations

from composer.client.systems.lifecycle_batch import active_dependents, inactive_dependents, lowered
from composer.runtime.protocol.reports import NodeReport


def robot(states: str) -> list[NodeReport]:
    """Return nodes in the order of the bring-up; ``states`` has a letter for each."""
    names = {"u": "unconfigured", "i": "inactive", "a": "active", "f": "finalized"}
    sensor, planner, logger, motor, camera = (names[letter] for letter in states)
    return [
        NodeReport("/sensor", sensor, state=sensor),
        NodeReport("/planner", planner, depends_on={"/sensor": "active"}, state=planner),
        NodeReport("/logger", logger, depends_on={"/planner": "inactive"}, state=logger),
        NodeReport("/motor", motor, depends_on={"/planner": "active"}, state=motor),
        NodeReport("/camera", camera, state=camera),
    ]


def test_only_goals_below_the_state_take_a_node_down() -> None:
    goals = {"/sensor": "inactive", "/planner": "active", "/motor": "finalized", "/arm": "inactive"}
    assert lowered(robot("aiaua"), goals) == {"/sensor": "inactive", "/motor": "finalized"}


def test_active_dependents_come_in_reverse_order() -> None:
    """The logger can do with an inactive planner."""
    assert active_dependents(robot("aaaaa"), {"/sensor": "inactive"}) == ("/motor", "/planner")
    assert active_dependents(robot("aaaaa"), {"/planner": "inactive"}) == ("/motor",)
    below = active_dependents(robot("aaaaa"), {"/planner": "unconfigured"})
    assert below == ("/motor", "/logger")
    assert active_dependents(robot("aaaaa"), {"/planner": "finalized"}) == below


def test_inactive_and_requested_nodes_are_left_out() -> None:
    assert active_dependents(robot("aiaia"), {"/sensor": "inactive"}) == ()
    goals = {"/planner": "inactive", "/motor": "inactive"}
    assert active_dependents(robot("aaaaa"), goals) == ()


def test_inactive_dependents_come_in_order_once_all_they_need_is_up() -> None:
    assert inactive_dependents(robot("iiaii"), {"/sensor": "active"}) == ("/planner", "/motor")
    assert inactive_dependents(robot("iiiii"), {"/planner": "active"}) == ("/logger", "/motor")
    assert inactive_dependents(robot("auiii"), {"/planner": "inactive"}) == ("/logger",)
    assert inactive_dependents(robot("iiaua"), {"/sensor": "active"}) == ("/planner",)
    assert inactive_dependents(robot("aaaai"), {"/camera": "active"}) == ()
