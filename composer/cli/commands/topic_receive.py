"""``compose topic echo`` and ``hz``, and the options that the commands for topics share."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from composer.cli.support.completion import complete_topic
from composer.cli.support.errors import UsageError
from composer.cli.support.options import DEFAULT_TIMEOUT_S, Json, quantity
from composer.cli.support.ros import ros_session
from composer.cli.support.terminal import as_json, as_yaml, say, truncated, write
from composer.model.qos import PRESETS, Durability, QosProfile, Reliability

if TYPE_CHECKING:
    from composer.client.messages.topics import RateStatistics, TopicSubscription
    from composer.language.expressions import Expression

_REPORT_EVERY_S = 1.0
#: Without --full-length, arrays and strings are cut to this length.
_MAX_LENGTH = 128


def _preset(name: str | None) -> str | None:
    """Return the value of --qos-profile. Raises typer.BadParameter."""
    if name is not None and name not in PRESETS:
        raise typer.BadParameter(f"'{name}' is not one of {', '.join(map(repr, PRESETS))}.")
    return name


Topic = Annotated[str, typer.Argument(metavar="TOPIC", autocompletion=complete_topic)]
QosPreset = Annotated[
    str | None,
    typer.Option(
        "--qos-profile",
        metavar=f"<{'|'.join(PRESETS)}>",
        callback=_preset,
        help="QoS preset.",
        autocompletion=lambda: list(PRESETS),
    ),
]
QosDepth = Annotated[
    int | None, typer.Option("--qos-depth", min=1, metavar="N", help="Length of the queue.")
]
QosReliability = Annotated[
    Reliability | None, typer.Option("--qos-reliability", help="QoS reliability.")
]
QosDurability = Annotated[
    Durability | None, typer.Option("--qos-durability", help="QoS durability.")
]
#: The values of these four options.
Policies: TypeAlias = tuple[str | None, int | None, Reliability | None, Durability | None]
#: One option for both limits. Without it, only the discovery of the topic is limited.
ReceiveTimeout = Annotated[
    float | None,
    quantity(
        "SECONDS",
        "--timeout",
        help="Maximum time to wait for the topic, and then for each message.",
        show_default=f"{DEFAULT_TIMEOUT_S} for the topic, no limit for messages",
    ),
]


def _filter(text: str | None) -> Expression | None:
    """Compile ``--filter`` before ROS starts."""
    if text is None:
        return None
    from composer.language.expressions import ExpressionError, compile_expression

    try:
        return compile_expression(text)
    except ExpressionError as error:
        raise UsageError(f"--filter: {error}") from error


Filter = Annotated[
    str | None,
    typer.Option(
        "--filter",
        metavar="EXPRESSION",
        help="Only messages for which the expression is true, such as 'message.data > 0'.",
    ),
]


def _path(path: str | None) -> str | None:
    """Check ``--field`` before ROS starts."""
    from composer.client.messages.field_paths import path_steps

    if path is not None:
        try:
            path_steps(path)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from error
    return path


def echo(
    topic: Topic,
    type_name: Annotated[
        str | None,
        typer.Argument(
            metavar="[TYPE]", help="The message type, needed if the topic has no publisher yet."
        ),
    ] = None,
    *,
    once: Annotated[bool, typer.Option("--once", help="Exit after the first message.")] = False,
    count: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Exit after N messages.")
    ] = None,
    field: Annotated[
        str | None,
        typer.Option(
            metavar="PATH",
            help="Print only this field, such as pose.position.x or transforms[0].header.",
            callback=_path,
        ),
    ] = None,
    condition: Filter = None,
    full_length: Annotated[
        bool,
        typer.Option(
            "--full-length", "-f", help=f"Do not cut arrays and strings after {_MAX_LENGTH} items."
        ),
    ] = False,
    no_arr: Annotated[
        bool, typer.Option("--no-arr", help="Print the length of arrays instead of the items.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="One JSON object per line, uncut.")] = False,
    preset: QosPreset = None,
    depth: QosDepth = None,
    reliability: QosReliability = None,
    durability: QosDurability = None,
    timeout: ReceiveTimeout = None,
) -> None:
    """Print messages from a topic.

    By default, the QoS profile of the subscription is compatible with all current publishers. The
    --qos-... options replace its policies.
    """
    expression = _filter(condition)
    policies = preset, depth, reliability, durability
    with _subscription(topic, type_name, timeout, policies) as subscription:
        from composer.client.messages.values import part
        from composer.runtime.ros.messages import to_plain

        left = 1 if once else count
        for message in _messages(subscription, timeout):
            if not _matches(expression, message):
                continue
            plain = to_plain(message if field is None else part(message, field))
            plain = without_items(plain) if no_arr else plain
            if json:
                write(as_json(plain))
            else:
                shown = plain if full_length else truncated(plain, _MAX_LENGTH)
                write(f"{as_yaml(shown)}\n---")
            left = None if left is None else left - 1
            if left == 0:
                return


@contextmanager
def _subscription(
    topic: str,
    type_name: str | None,
    timeout_s: float | None,
    policies: Policies,
    *,
    measures: bool = False,
    raw: bool = False,
) -> Iterator[TopicSubscription]:
    """Subscribe to a topic with the strictest profile that its publishers satisfy.

    A subscription that ``measures`` gets no messages from before it; ``raw`` ones are serialized.
    """
    limit_s = DEFAULT_TIMEOUT_S if timeout_s is None else timeout_s
    with ros_session("compose topic", limit_s, carries_messages=True) as (session, deadline):
        from composer.client.graph_names import GraphNames, full_name
        from composer.client.messages import topics
        from composer.model.qos import strictest_compatible

        name = full_name("topic", topic)
        message_type = type_name or GraphNames(session, deadline).only_type("topic", name)
        strictest = topics.measuring_qos if measures else strictest_compatible
        offers = topics.offered_profiles(session, name)
        profile = with_policies(strictest(offers, topics.SUBSCRIPTION_DEPTH), policies)
        found = topics.TopicSubscription(session, name, message_type, profile, raw=raw)
        with closing(found):
            yield found


def without_items(value: Any) -> Any:
    """Return plain data with its lists replaced by their lengths."""
    if isinstance(value, list):
        return f"<{len(value)} items>"
    if isinstance(value, dict):
        return {name: without_items(item) for name, item in value.items()}
    return value


def _messages(subscription: TopicSubscription, timeout_s: float | None) -> Iterator[Any]:
    from composer.client.session import Deadline

    limit_s = float("inf") if timeout_s is None else timeout_s
    while True:
        received = subscription.wait(Deadline(limit_s))
        if not received:
            raise subscription.no_message_error(limit_s)
        for item in received:
            yield item.content


def _matches(expression: Expression | None, message: Any) -> bool:
    """Say whether ``--filter`` is true. Raises RosError if it cannot be evaluated."""
    if expression is None:
        return True
    from composer.client.session import RosError
    from composer.language.expressions import EvaluationError

    try:
        return bool(expression.evaluate({"message": message}))
    except EvaluationError as error:
        raise RosError(f"--filter: {error}") from error


def with_policies(profile: QosProfile, policies: Policies) -> QosProfile:
    """Return ``profile``, or the preset, with the policies that are given."""
    preset, *values = policies
    pairs = zip(("depth", "reliability", "durability"), values, strict=True)
    given: dict[str, Any] = {name: value for name, value in pairs if value is not None}
    return replace(profile if preset is None else PRESETS[preset], **given)


def hz(
    topic: Topic,
    *,
    window: Annotated[
        int, typer.Option("--window", "-w", min=2, metavar="N", help="Use the last N messages.")
    ] = 10_000,
    count: Annotated[
        int | None,
        typer.Option(min=2, metavar="N", help="Exit after N messages.", show_default="no limit"),
    ] = None,
    condition: Filter = None,
    json: Json = False,
    preset: QosPreset = None,
    depth: QosDepth = None,
    reliability: QosReliability = None,
    durability: QosDurability = None,
    timeout: ReceiveTimeout = None,
) -> None:
    """Print the average rate of a topic every second."""
    expression = _filter(condition)
    policies = preset, depth, reliability, durability
    raw = expression is None  # serialized messages are enough to count them
    with _subscription(topic, None, timeout, policies, measures=True, raw=raw) as subscription:
        from composer.client.messages.topics import RateWindow
        from composer.client.session import Deadline

        rates = RateWindow(window)
        silence_s = float("inf") if timeout is None else timeout
        left = sys.maxsize if count is None else count
        unreported = 0
        next_report, next_message = Deadline(_REPORT_EVERY_S), Deadline(silence_s)
        while left:
            wait = Deadline(min(next_report.left_s, next_message.left_s))
            received = subscription.wait(wait)
            items = [item for item in received if _matches(expression, item.content)][:left]
            for item in items:
                rates.add(item.received_ns * 1e-9)
            left -= len(items)
            unreported += len(items)
            if items:
                next_message = Deadline(silence_s)
            elif next_message.passed:
                raise subscription.no_message_error(silence_s)
            if next_report.passed:
                _report(subscription.topic, rates.statistics(), unreported, json=json)
                unreported, next_report = 0, Deadline(_REPORT_EVERY_S)
        if unreported:
            _report(subscription.topic, rates.statistics(), unreported, json=json)


def _report(topic: str, rate: RateStatistics | None, messages: int, *, json: bool) -> None:
    """Print the rate after ``messages`` new messages."""
    if not messages:
        say(f"no new messages on '{topic}'")
    elif rate is None:
        say(f"too few messages on '{topic}' to measure them yet")
    elif json:
        write(as_json(asdict(rate)))
    else:
        write(
            f"average rate: {rate.average_hz:.3f} Hz  min: {rate.shortest_s:.4f} s"
            f"  max: {rate.longest_s:.4f} s  std dev: {rate.deviation_s:.5f} s"
            f"  window: {rate.window}"
        )
