"""``compose topic list``, ``type`` and ``find``: names and types."""

from __future__ import annotations

from typing import Annotated

import typer

from composer.cli.commands.ros.topic.receiving import Topic
from composer.cli.support.completion import complete_message_type
from composer.cli.support.options import (
    DEFAULT_TIMEOUT_S,
    CountTopics,
    HiddenTopics,
    Json,
    ShowTypes,
    Timeout,
)
from composer.cli.support.output.results import print_found, print_names, print_types
from composer.cli.support.ros import graph_names, names_of_type, types_of


def list_topics(
    *,
    types: ShowTypes = False,
    count: CountTopics = False,
    hidden: HiddenTopics = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List topics."""
    topics = graph_names("compose topic", "topic", timeout, hidden=hidden)
    print_names("topic", topics, types=types, count=count, json=json)


def type_of(topic: Topic, *, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Print the type of a topic."""
    print_types(types_of("compose topic", "topic", topic, timeout), json=json)


def find(
    type_name: Annotated[str, typer.Argument(metavar="TYPE", autocompletion=complete_message_type)],
    *,
    count: CountTopics = False,
    hidden: HiddenTopics = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List the topics of a type."""
    names = names_of_type("compose topic", "topic", type_name, timeout, hidden=hidden)
    print_found("topic", type_name, names, count=count, json=json)
