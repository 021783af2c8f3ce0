"""The endpoints of all nodes, as running systems on this computer know them."""

from __future__ import annotations

from contextlib import suppress

from composer.plan.drift import ObservedEndpoint, parse_endpoint
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.process.query_socket import ENDPOINTS, ask

#: Of the largest systems: discovering the graph takes longer.
_RESPONSE_S = 1.0


def local_endpoints() -> tuple[dict[str, tuple[ObservedEndpoint, ...]], list[str]] | None:
    """Return the endpoints by node, and the names of all nodes.

    A name that two nodes share is listed twice. None if no system on this computer is certain.
    """
    answers = (ask(system, ENDPOINTS, None, _RESPONSE_S) for system in local_systems())
    answer = next((answer for answer in answers if answer), None)
    with suppress(ValueError, KeyError, TypeError, AttributeError):  # of another version
        if answer is not None:
            ends = answer["endpoints"].items()
            found = {str(name): tuple(map(parse_endpoint, of_node)) for name, of_node in ends}
            return found, list(map(str, answer["nodes"]))
    return None
