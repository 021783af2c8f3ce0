"""Enlarges the shared memory segment in which this process sends large messages.

The default segment of Fast DDS (0.5 MB) does not hold one image of 640 x 480 pixels: its fragments
wait for each other, and with best-effort QoS most of them are lost. See
docs/decisions/0013-fast-dds.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from tempfile import NamedTemporaryFile

from composer.runtime.middleware.dds_profiles import is_own_profile
from composer.runtime.middleware.shared_memory import (
    LARGE_SEGMENT_BYTES,
    MEGABYTE,
    MIN_FREE_BYTES,
    SHARED_MEMORY,
    free_bytes,
)

_PROFILES_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_TRANSPORTS_VARIABLE = "FASTDDS_BUILTIN_TRANSPORTS"
_RANGE_VARIABLE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
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
    if before.get(_RANGE_VARIABLE) == "LOCALHOST":
        peers = list(filter(None, before.get(_PEERS_VARIABLE, "").split(";")))
    content = profile_with_segment(before[_PROFILES_VARIABLE], peers)
    with ExitStack() as stack:
        with suppress(OSError):  # no folder for temporary files
            file = stack.enter_context(NamedTemporaryFile(prefix="fast_dds_", suffix=".xml"))
            file.write(content)
            file.flush()
            stack.callback(environment.update, before)
            environment[_PROFILES_VARIABLE] = file.name
            if peers is not None:
                environment[_RANGE_VARIABLE] = "SYSTEM_DEFAULT"
        yield


def profile_with_segment(path: str, peers: Sequence[str] | None) -> bytes:
    """Return the profile in the file ``path`` with a large segment, as XML.

    With ``peers``, it also implements the discovery range LOCALHOST with these static peers.
    """
    from html import escape  # noqa: PLC0415 - slow, and few systems send large messages

    from composer.runtime.middleware.dds_xml import Profile, child, extend  # noqa: PLC0415

    profile = Profile(path)
    child(profile.shared_memory, "segment_size").text = str(LARGE_SEGMENT_BYTES)
    child(profile.shared_memory, "maxMessageSize").text = str(_MESSAGE_BYTES)
    if peers is not None:
        child(profile.udp, "maxInitialPeersRange").text = str(_PARTICIPANTS_ON_LOCALHOST)
        known = "".join(_PEER.format(escape(peer)) for peer in ("127.0.0.1", *peers))
        locators = f"<initialPeersList>{known}</initialPeersList>"
        extend(child(profile.rtps, "builtin"), _NO_MULTICAST + locators)
    return profile.text().encode()
