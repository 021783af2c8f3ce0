"""The name, services and topics of the manager node, for the manager and its clients.

Commands import this and not the manager, whose imports include the whole runtime.
"""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile

NAME = "manager"

#: Services: std_srvs/srv/Trigger; ChangeState for nodes without lifecycle services.
IS_ACTIVE = "is_active"
#: At the end of ``startup`` and ``resume``: undo everything if a node fails.
ALL_OR_NOTHING = "_all_or_nothing"
CHANGE_STATE = "change_state"
#: Of the processes of a system: rcl_interfaces/srv/SetParameters, with a list of texts as the value
#: of the parameter ``steps``, or of ``last_steps`` if the process ends after them:
#: ``deactivate /arm /gripper`` deactivates /arm after the transition of /gripper, if one was
#: requested before. The only standard service with results for each: why it failed, or the number
#: of the last report on ``state`` that may not include it. The parameter ``goals`` has what is
#: requested of the whole system, which the process keeps and reports: see ``plan/system_goals.py``.
#: The step ``create /arm`` creates a finalized node again, which is unconfigured then.
#: With the parameter ``figures``, a last result has the timings of callbacks and chains as its
#: reason, as JSON: see ``metrics/figures.py``. The parameter ``participant`` has the one that
#: is meant, as it reports itself: another process of the same name, on another computer for
#: example, receives the request as well, but neither follows nor answers it. The parameters
#: ``sender`` and ``numbers`` identify the steps, and ``seen_report`` is the number of the last
#: report that the sender has received: see ``manager/received_steps.py``. With the parameter
#: ``report_key``, a process that was not started by a coordinating one has the key of its reports
#: as the reason of the last result: see ``members/report.py``.
CHANGE_STATES = "change_states"
STEPS = "steps"
CREATE = "create"
LAST_STEPS = "last_steps"
GOALS = "goals"
FIGURES = "figures"
REPORT_KEY = "report_key"
PARTICIPANT = "participant"
SENDER = "sender"
NUMBERS = "numbers"
SEEN_REPORT = "seen_report"
#: rcl_interfaces/srv/SetParametersAtomically, with the full names of nodes in the parameter
#: ``nodes``: the only standard service that takes names and returns a reason.
RESTART = "restart"
RESTART_NODES = "nodes"
#: A hidden service of each manager, with a unique name: see ``manager/other_instances.py``.
INSTANCE_PREFIX = "_instance_"

STATE_TOPIC = "state"
#: Transient local: a late joiner gets the last message at once.
STATE_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CALLBACKS_TOPIC = "callbacks"
CALLBACKS_QOS = QoSProfile(depth=10)


def full_parameter_name(node: str, parameter: str) -> str:
    """Return the manager's name of a node's parameter: node names have no dots."""
    return f"{node}.{parameter}"
