"""Changes to our profiles of Fast DDS, which are XML: interfaces, announcements, segments.

The default segment of Fast DDS (0.5 MB) does not hold one image of 640 x 480 pixels: its fragments
wait for each other, and with best-effort QoS most of them are lost. See
docs/decisions/0011-fast-dds.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from html import escape
from tempfile import NamedTemporaryFile
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from composer.model import Discovery
from composer.runtime.middleware.environment import (
    PROFILES_VARIABLE,
    RANGE_VARIABLE,
    TRANSPORTS_VARIABLE,
    is_default_profile,
    is_own_profile,
    save_profile,
)
from composer.runtime.middleware.local_resources import (
    LARGE_SEGMENT_BYTES,
    MEGABYTE,
    MIN_FREE_BYTES,
    SHARED_MEMORY,
    free_bytes,
)
from composer.runtime.process import StartRefused
from composer.runtime.process.computer import has_interface, interface_names

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
_UNUSED = "'interfaces' of the system are not used"
#: With others, rmw_fastrtps replaces the transports of a profile.
_RANGES = ("", "SUBNET", "SYSTEM_DEFAULT")
_PEERS_VARIABLE = "ROS_STATIC_PEERS"
#: With it, rmw_fastrtps sets up the transports in a way that a profile cannot express.
_DEPRECATED_VARIABLE = "ROS_LOCALHOST_ONLY"
#: The limit of Fast DDS without a profile.
_MESSAGE_BYTES = 65_500
#: What rmw_fastrtps sets for ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST: a profile with that variable
#: would have two shared memory transports. See fast_dds_commands_localhost.xml.
_PARTICIPANTS_ON_LOCALHOST = 32
_NO_MULTICAST = "<metatrafficUnicastLocatorList><locator/></metatrafficUnicastLocatorList>"
_PEER = "<locator><udpv4><address>{}</address></udpv4></locator>"


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


def use_interfaces(discovery: Discovery, environment: MutableMapping[str, str]) -> list[str]:
    """Select a profile for the network interfaces of a system, which has some.

    Return a warning if the environment prevents it. Raises StartRefused if there is no such
    interface: Fast DDS would discover nothing, and only log why.
    """
    interfaces = [item.value for item in discovery.interfaces]
    for text in interfaces:
        if not has_interface(text):
            raise StartRefused(
                f"this computer has no network interface '{text}' ('discovery' of the system)",
                f"it has {', '.join(interface_names())}; see 'ip address'",
            )
    if (
        not is_own_profile(environment)
        or environment.get(TRANSPORTS_VARIABLE)
        or environment.get(RANGE_VARIABLE, "") not in _RANGES
    ):
        return [
            f"{_UNUSED}: the environment sets a profile or transports of Fast DDS, or"
            f" {RANGE_VARIABLE}"
        ]
    content = profile_for_interfaces(environment[PROFILES_VARIABLE], interfaces)
    try:
        environment[PROFILES_VARIABLE] = str(save_profile(content))
    except OSError as error:
        return [f"{_UNUSED}: cannot write the profile '{error.filename}': {error.strerror}"]
    return []


def profile_for_interfaces(path: str, interfaces: Sequence[str]) -> str:
    """Return the profile in the file ``path`` with these network interfaces only, as XML."""
    profile = Profile(path)
    allowed = child(profile.udp, "interfaceWhiteList")
    for interface in interfaces:
        is_address = interface.replace(".", "").isdigit()
        add(allowed, "address" if is_address else "interface", interface)
    return profile.text()


def announce_less_often(environment: MutableMapping[str, str]) -> None:
    """Select a profile with the default period of announcements, 3 s.

    Each announcement goes to all possible participants of this computer. Other processes answer the
    first one of this process, and it answers theirs. Without a folder to write to, or if the user
    has configured Fast DDS, nothing changes.
    """
    if is_default_profile(environment):
        with suppress(OSError):
            content = without(environment[PROFILES_VARIABLE], "leaseAnnouncement")
            environment[PROFILES_VARIABLE] = str(save_profile(content))


def segment_for_large_messages(
    environment: MutableMapping[str, str], rmw: str, warn: Callable[[str], None]
) -> AbstractContextManager[None]:
    """Return a block that selects a large segment: join the ROS graph in it.

    Without effect with another middleware than rmw_fastrtps, or if the user has configured it. If
    there is not enough shared memory, call ``warn`` and keep the default size.
    """
    if not rmw.startswith("rmw_fastrtps") or not _may_choose(environment):
        return nullcontext()
    free = free_bytes()
    if free < MIN_FREE_BYTES:
        warn(
            f"only {free // MEGABYTE} MB are free in {SHARED_MEMORY}: large messages to other"
            " processes may be late or lost; see 'compose doctor'"
        )
        return nullcontext()
    return enlarged_segment(environment)


def _may_choose(environment: Mapping[str, str]) -> bool:
    """Say whether the user has not configured the transports of Fast DDS."""
    reach = environment.get(RANGE_VARIABLE)
    if environment.get(TRANSPORTS_VARIABLE) or not is_own_profile(environment):
        return False
    if reach == "LOCALHOST":
        return not environment.get(_DEPRECATED_VARIABLE)
    return reach != "OFF"


@contextmanager
def enlarged_segment(environment: MutableMapping[str, str]) -> Iterator[None]:
    """Within the block, select a profile with a large segment.

    Afterwards, the environment is as before: processes that this one starts have segments of their
    own.
    """
    before = dict(environment)
    peers = None
    if before.get(RANGE_VARIABLE) == "LOCALHOST":
        peers = list(filter(None, before.get(_PEERS_VARIABLE, "").split(";")))
    content = profile_with_segment(before[PROFILES_VARIABLE], peers)
    with ExitStack() as stack:
        with suppress(OSError):  # no folder for temporary files
            file = stack.enter_context(NamedTemporaryFile(prefix="fast_dds_", suffix=".xml"))
            file.write(content)
            file.flush()
            stack.callback(environment.update, before)
            environment[PROFILES_VARIABLE] = file.name
            if peers is not None:
                environment[RANGE_VARIABLE] = "SYSTEM_DEFAULT"
        yield


def profile_with_segment(path: str, peers: Sequence[str] | None) -> bytes:
    """Return the profile in the file ``path`` with a large segment, as XML.

    With ``peers``, it also implements the discovery range LOCALHOST with these static peers.
    """
    profile = Profile(path)
    child(profile.shared_memory, "segment_size").text = str(LARGE_SEGMENT_BYTES)
    child(profile.shared_memory, "maxMessageSize").text = str(_MESSAGE_BYTES)
    if peers is not None:
        child(profile.udp, "maxInitialPeersRange").text = str(_PARTICIPANTS_ON_LOCALHOST)
        known = "".join(_PEER.format(escape(peer)) for peer in ("127.0.0.1", *peers))
        locators = f"<initialPeersList>{known}</initialPeersList>"
        extend(child(profile.rtps, "builtin"), _NO_MULTICAST + locators)
    return profile.text().encode()
