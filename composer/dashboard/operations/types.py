"""Operations on types of interfaces: forms, names and paths of fields."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.dashboard.context import Dashboard, Prepared
from composer.dashboard.protocol.messages import Values

if TYPE_CHECKING:
    from composer.client.session import Deadline
    from composer.dashboard.ros_side import RosGraphSide

_KINDS = ("message", "service", "action")
_CHANNELS = ("topic", "service", "action")
_READ_S = 5.0


def form(values: Values, dashboard: Dashboard) -> Prepared:
    """Return the fields of each part of a type."""
    del dashboard
    type_name = values.text("type")
    values.optional_text("kind")  # the type says it, too

    def run(ros: RosGraphSide, deadline: Deadline) -> dict[str, Any]:
        del deadline
        return {"type": type_name, "parts": ros.forms.form(type_name)}

    return run, _READ_S


def types(values: Values, dashboard: Dashboard) -> Prepared:
    """Return names of types that contain a text."""
    del dashboard
    kind, prefix = values.choice("kind", _KINDS), values.text("prefix", "")

    def run(ros: RosGraphSide, deadline: Deadline) -> dict[str, Any]:
        del deadline
        return {"names": ros.forms.names(kind, prefix)}

    return run, _READ_S


def fields(values: Values, dashboard: Dashboard) -> Prepared:
    """Return the paths of the fields of a message."""
    del dashboard
    type_name = values.text("type")

    def run(ros: RosGraphSide, deadline: Deadline) -> dict[str, Any]:
        del deadline
        return ros.forms.paths(type_name)

    return run, _READ_S


def type_of(values: Values, dashboard: Dashboard) -> Prepared:
    """Return the types of a topic, service or action."""
    del dashboard
    kind, name = values.choice("kind", _CHANNELS), values.text("name")

    def run(ros: RosGraphSide, deadline: Deadline) -> dict[str, Any]:
        from composer.client.graph_names import GraphNames

        return {"types": list(GraphNames(ros.session, deadline).types(kind, name))}

    return run, _READ_S
