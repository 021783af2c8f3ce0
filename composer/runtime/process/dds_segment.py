"""Enlarges the shared memory segment in which this process sends large messages.

The default segment of Fast DDS (0.5 MB) does not hold one image of 640 x 480 pixels: its fragments
wait for each other, and with best-effort QoS most of them are lost. See
docs/decisions/0050-shared-memory-segment.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, MutableMapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from tempfile import NamedTemporaryFile
from xml.etree import ElementTree

from composer.runtime.process.dds_profiles import is_own_profile
from composer.runtime.process.shared_memory import (
    LARGE_SEGMENT_BYTES,
    MEGABYTE,
    MIN_FREE_BYTES,
    SHARED_MEMORY,
    free_bytes,
)

_PROFILES_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_TRANSPORTS_VARIABLE = "FASTDDS_BUILTIN_TRANSPORTS"
_RANGE_VARIABLE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
#: With one of them, rmw_fastrtps sets up the transports in a way that a profile cannot express.
_OTHER_RANGE_VARIABLES = ("ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY")
_NAMESPACE = "http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"
_SEGMENT = f"""
<transport_descriptors xmlns="{_NAMESPACE}">
  <transport_descriptor>
    <transport_id>shared_memory</transport_id>
    <type>SHM</type>
    <segment_size>{LARGE_SEGMENT_BYTES}</segment_size>
    <maxMessageSize>65500</maxMessageSize>
  </transport_descriptor>
  <transport_descriptor>
    <transport_id>udp</transport_id>
    <type>UDPv4</type>
  </transport_descriptor>
</transport_descriptors>
"""
_TRANSPORTS = f"""
<rtps xmlns="{_NAMESPACE}">
  <useBuiltinTransports>false</useBuiltinTransports>
  <userTransports>
    <transport_id>shared_memory</transport_id>
    <transport_id>udp</transport_id>
  </userTransports>
</rtps>
"""
#: What rmw_fastrtps sets for ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST: a profile with that variable
#: would have two shared memory transports. See fast_dds_commands_localhost.xml.
_INITIAL_PEERS = f'<maxInitialPeersRange xmlns="{_NAMESPACE}">32</maxInitialPeersRange>'
_LOCALHOST = f"""
<builtin xmlns="{_NAMESPACE}">
  <metatrafficUnicastLocatorList><locator/></metatrafficUnicastLocatorList>
  <initialPeersList>
    <locator><udpv4><address>127.0.0.1</address></udpv4></locator>
  </initialPeersList>
</builtin>
"""


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
    reach = environment.get(_RANGE_VARIABLE)
    if environment.get(_TRANSPORTS_VARIABLE) or not is_own_profile(environment):
        return False
    if reach == "LOCALHOST":
        return not any(map(environment.get, _OTHER_RANGE_VARIABLES))
    return reach != "OFF"


@contextmanager
def enlarged_segment(environment: MutableMapping[str, str]) -> Iterator[None]:
    """Within the block, select a profile with a large segment.

    Afterwards, the environment is as before: processes that this one starts have segments of their
    own.
    """
    before = dict(environment)
    localhost = before.get(_RANGE_VARIABLE) == "LOCALHOST"
    content = profile_with_segment(before[_PROFILES_VARIABLE], localhost=localhost)
    with ExitStack() as stack:
        with suppress(OSError):  # no folder for temporary files
            file = stack.enter_context(NamedTemporaryFile(prefix="fast_dds_", suffix=".xml"))
            file.write(content)
            file.flush()
            stack.callback(environment.update, before)
            environment[_PROFILES_VARIABLE] = file.name
            if localhost:
                environment[_RANGE_VARIABLE] = "SYSTEM_DEFAULT"
        yield


def profile_with_segment(path: str, *, localhost: bool) -> bytes:
    """Return the profile in the file ``path`` with a large segment, as XML.

    With ``localhost``, it implements that discovery range as well.
    """
    ElementTree.register_namespace("", _NAMESPACE)
    root = ElementTree.parse(path).getroot()  # noqa: S314 - a file of ours
    profiles = _child(root, "profiles")
    descriptors = _parse(_SEGMENT)
    profiles.insert(0, descriptors)
    rtps = _child(_participant(profiles), "rtps")
    rtps.extend(_parse(_TRANSPORTS))
    if localhost:
        descriptors[-1].append(_parse(_INITIAL_PEERS))
        _child(rtps, "builtin").extend(_parse(_LOCALHOST))
    text = ElementTree.tostring(root, encoding="unicode")
    return text.encode()


def _parse(text: str) -> ElementTree.Element:
    return ElementTree.fromstring(text)  # noqa: S314 - a text of ours


def _participant(profiles: ElementTree.Element) -> ElementTree.Element:
    participant = _child(profiles, "participant")
    participant.attrib |= {"profile_name": "composer", "is_default_profile": "true"}
    return participant


def _child(parent: ElementTree.Element, name: str) -> ElementTree.Element:
    """Return the child ``name``, which is added if it is missing."""
    tag = f"{{{_NAMESPACE}}}{name}"
    found = parent.find(tag)
    return ElementTree.SubElement(parent, tag) if found is None else found
