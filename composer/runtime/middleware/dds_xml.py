"""Reads and changes the XML profiles of Fast DDS."""

from __future__ import annotations

from xml.etree import ElementTree
from xml.etree.ElementTree import Element

_NAMESPACE = "http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"
_SHARED_MEMORY, _UDP = "shared_memory", "udp"
_DESCRIPTORS = f"""
<transport_descriptors xmlns="{_NAMESPACE}">
  <transport_descriptor>
    <transport_id>{_SHARED_MEMORY}</transport_id>
    <type>SHM</type>
  </transport_descriptor>
  <transport_descriptor>
    <transport_id>{_UDP}</transport_id>
    <type>UDPv4</type>
  </transport_descriptor>
</transport_descriptors>
"""
_USED = f"""
<rtps xmlns="{_NAMESPACE}">
  <useBuiltinTransports>false</useBuiltinTransports>
  <userTransports>
    <transport_id>{_SHARED_MEMORY}</transport_id>
    <transport_id>{_UDP}</transport_id>
  </userTransports>
</rtps>
"""


class Profile:
    """A profile with transports of its own, which replace the default ones of Fast DDS.

    ``shared_memory`` and ``udp`` describe the transports, ``rtps`` the participant.
    """

    def __init__(self, path: str) -> None:
        """Read the profile in the file ``path``, and add the transports if it has none."""
        self._root = ElementTree.parse(path).getroot()  # noqa: S314 - a file of ours
        profiles = child(self._root, "profiles")
        participant = child(profiles, "participant")
        participant.attrib |= {"profile_name": "composer", "is_default_profile": "true"}
        self.rtps = child(participant, "rtps")
        descriptors = _find(profiles, "transport_descriptors")
        if descriptors is None:
            descriptors = _parse(_DESCRIPTORS)
            profiles.insert(0, descriptors)
            self.rtps.extend(_parse(_USED))
        self.shared_memory, self.udp = descriptors

    def text(self) -> str:
        """Return the profile as XML."""
        return _text(self._root)


def without(path: str, name: str) -> str:
    """Return the profile in the file ``path`` without the elements ``name``, as XML."""
    root = ElementTree.parse(path).getroot()  # noqa: S314 - a file of ours
    for parent in tuple(root.iter()):
        for element in parent.findall(f"{{{_NAMESPACE}}}{name}"):
            parent.remove(element)
    return _text(root)


def child(parent: Element, name: str) -> Element:
    """Return the child ``name``, which is added if it is missing."""
    found = _find(parent, name)
    return add(parent, name) if found is None else found


def add(parent: Element, name: str, text: str | None = None) -> Element:
    """Add a child."""
    element = ElementTree.SubElement(parent, f"{{{_NAMESPACE}}}{name}")
    element.text = text
    return element


def texts(parent: Element, name: str) -> list[str]:
    """Return the texts of all elements ``name`` in ``parent``."""
    return [element.text or "" for element in parent.iter(f"{{{_NAMESPACE}}}{name}")]


def extend(parent: Element, text: str) -> None:
    """Add elements, which are given as XML without the namespace of the profiles."""
    parent.extend(_parse(f'<all xmlns="{_NAMESPACE}">{text}</all>'))


def _find(parent: Element, name: str) -> Element | None:
    return parent.find(f"{{{_NAMESPACE}}}{name}")


def _text(root: Element) -> str:
    ElementTree.register_namespace("", _NAMESPACE)
    return ElementTree.tostring(root, encoding="unicode")


def _parse(text: str) -> Element:
    return ElementTree.fromstring(text)  # noqa: S314 - a text of ours
