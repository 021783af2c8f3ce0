"""Serialized messages (CDR) of other programs: publishing them, and calling services with them."""

from __future__ import annotations

from contextlib import closing
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

from composer.client.graph_names import type_mismatch_hint
from composer.client.messages.values import InvalidValueError, class_of
from composer.client.name_matching import full_name
from composer.client.requests import ServiceCaller
from composer.client.session import Deadline, NoResponseError, Session
from composer.model.qos import QosProfile
from composer.runtime.ros.qos_profiles import rclpy_profile


class SerializedPublisher:
    """Publishes serialized messages once they have proven to be messages of the type."""

    def __init__(self, session: Session, topic: str, type_name: str, qos: QosProfile) -> None:
        """Raise InvalidValueError or InvalidNameError for a type or a name that is not valid."""
        self._session = session
        self._class = class_of(type_name)
        self._type_name = type_name
        self._publisher = session.node.create_publisher(
            self._class, full_name("topic", topic), rclpy_profile(qos)
        )

    def publish(self, data: bytes) -> None:
        """Publish a message. Raises InvalidValueError."""
        self._publisher.publish(_message(data, self._class, self._type_name))

    def close(self) -> None:
        """Destroy the publisher."""
        self._session.node.destroy_publisher(self._publisher)


def call_serialized(
    session: Session, deadline: Deadline, service: str, type_name: str, request: bytes
) -> bytes:
    """Return the response of a service. Raises InvalidValueError, NoResponseError."""
    service_class = class_of(type_name, "service")
    message = _message(request, service_class.Request, f"{type_name}_Request")
    with closing(ServiceCaller(session)) as caller:
        try:
            response = caller.call_once(service_class, service, message, deadline)
        except NoResponseError as error:
            hint = type_mismatch_hint(session, "service", service, type_name)
            raise NoResponseError(str(error), hint) from error
    return bytes(serialize_message(response))


def _message(data: bytes, message_class: Any, type_name: str) -> Any:
    """Return a message. Raises InvalidValueError."""
    if not message_class.get_fields_and_field_types():
        return message_class()  # programs disagree about the bytes of a message without fields
    try:
        return deserialize_message(data, message_class)
    except Exception as error:  # classes of the RMW implementation, which are not public
        raise InvalidValueError(f"{len(data)} bytes are not a message {type_name}") from error
