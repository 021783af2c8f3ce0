"""What DDS checks of a policy: the topics that each process may use, named as in DDS.

DDS Security 1.1 (9.4.1.3) defines the format; SROS2 translates policies to it in the same way. A
service is a topic for its requests and one for its responses.
"""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree as Xml

from composer.bridges.export.sros2 import Enclave, enclaves
from composer.model import PortKind, System

#: The nodes of each participant, as the middleware publishes them.
_GRAPH_TOPIC = "ros_discovery_info"
#: A grant is only used with the identity certificate of the process, whose validity is its limit.
_VALIDITY = ("2000-01-01T00:00:00", "2099-12-31T23:59:59")
_ACTION_SERVICES = ("cancel_goal", "get_result", "send_goal")
_ACTION_TOPICS = ("feedback", "status")
_DIRECTIONS = ("publish", "subscribe")


def permissions(system: System, domain_id: int) -> dict[str, str]:
    """Return the permissions file of each enclave of a system, by the path of the enclave.

    They apply to one ROS domain, and have to be signed.
    """
    name = system.name.value
    return {item.path: _file(item, name, domain_id) for item in enclaves(system)}


def _file(enclave: Enclave, system: str, domain_id: int) -> str:
    root = Xml.Element("dds")
    grant = Xml.SubElement(Xml.SubElement(root, "permissions"), "grant", name=enclave.path)
    Xml.SubElement(grant, "subject_name").text = f"CN={enclave.path}"
    validity = Xml.SubElement(grant, "validity")
    for tag, time in zip(("not_before", "not_after"), _VALIDITY, strict=True):
        Xml.SubElement(validity, tag).text = time
    rule = Xml.SubElement(grant, "allow_rule")
    Xml.SubElement(Xml.SubElement(rule, "domains"), "id").text = str(domain_id)
    allowed: dict[str, set[str]] = {direction: {_GRAPH_TOPIC} for direction in _DIRECTIONS}
    for profile in enclave.profiles:
        for kind, names in profile.names.items():
            for name in names:
                for direction, topics in zip(_DIRECTIONS, _topics(kind, name), strict=True):
                    allowed[direction].update(topics)
    for direction, topics in allowed.items():
        listed = Xml.SubElement(Xml.SubElement(rule, direction), "topics")
        for topic in sorted(topics):
            Xml.SubElement(listed, "topic").text = topic
    Xml.SubElement(grant, "default").text = "DENY"
    Xml.indent(root)
    comment = f"<!-- Written by 'compose export sros2' for the system {system}. -->"
    text = Xml.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{comment}\n{text}\n'


def _topics(kind: PortKind, name: str) -> tuple[Iterable[str], Iterable[str]]:
    """Return the topics that a port publishes and those that it subscribes to."""
    match kind:
        case PortKind.PUBLISHER:
            return [f"rt{name}"], []
        case PortKind.SUBSCRIPTION:
            return [], [f"rt{name}"]
        case PortKind.CLIENT:
            return [f"rq{name}Request"], [f"rr{name}Reply"]
        case PortKind.SERVICE:
            return [f"rr{name}Reply"], [f"rq{name}Request"]
    requests = [f"rq{name}/_action/{service}Request" for service in _ACTION_SERVICES]
    replies = [f"rr{name}/_action/{service}Reply" for service in _ACTION_SERVICES]
    replies += [f"rt{name}/_action/{topic}" for topic in _ACTION_TOPICS]
    return (replies, requests) if kind is PortKind.ACTION_SERVER else (requests, replies)
