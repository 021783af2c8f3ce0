"""composer.model.names against rcl's own validation, over random names."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from rclpy.exceptions import (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidTopicNameException,
)
from rclpy.expand_topic_name import expand_topic_name
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name
from rclpy.validate_topic_name import validate_topic_name

from composer.model.names import (
    MAXIMUM_NAMESPACE_LENGTH,
    MAXIMUM_NODE_NAME_LENGTH,
    MAXIMUM_TOPIC_NAME_LENGTH,
    expand_name,
    namespace_problem,
    node_name_problem,
    topic_name_problem,
)
from tests.examples import examples

INVALID = (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidTopicNameException,
    ValueError,
)
#: What the design page forbids and rcl lets through: '/a__b', and '~a', which it makes '/na'.
STRICTER = ("contains '__'", "has no '/' after '~'")
# Braces are substitutions to rcl and expressions to the composer: the one thing left out.
NAMES = st.text(alphabet="ab_1/~ é-.", max_size=12)
TOKENS = st.lists(
    st.sampled_from(["a", "b2", "_c", "d__e", "1f", "", "~", "g_"]), min_size=1, max_size=5
).map("/".join)


def agree(problem: str | None, accepted: bool) -> bool:
    """Return whether both agree; the composer keeps to the design page where rcl does not."""
    return problem in STRICTER or (problem is None) == accepted


def accepts(validate: Callable[..., object], *arguments: str) -> bool:
    try:
        validate(*arguments)
    except INVALID:
        return False
    return True


@given(NAMES)
@example("a" * MAXIMUM_NODE_NAME_LENGTH)
@example("a" * (MAXIMUM_NODE_NAME_LENGTH + 1))
def test_node_names(name: str) -> None:
    assert agree(node_name_problem(name), accepts(validate_node_name, name))


@given(st.one_of(NAMES, TOKENS).map(lambda text: "/" + text))
@example("/")
@example("/" + "a" * (MAXIMUM_NAMESPACE_LENGTH - 1))
@example("/" + "a" * MAXIMUM_NAMESPACE_LENGTH)
def test_namespaces(name: str) -> None:
    assert agree(namespace_problem(name), accepts(validate_namespace, name))


def full_name(name: str) -> str:
    """Return what rcl makes of a name in a node, which it validates before and after."""
    validate_topic_name(name)
    expanded = expand_topic_name(name, "n", "/")
    validate_full_topic_name(expanded)
    return str(expanded)


@given(st.one_of(NAMES, TOKENS))
@example("~")
@example("/" + "a" * (MAXIMUM_TOPIC_NAME_LENGTH - 1))
@example("/" + "a" * MAXIMUM_TOPIC_NAME_LENGTH)
def test_topic_names(name: str) -> None:
    assert agree(topic_name_problem(name), accepts(full_name, name))


@examples(200)
@given(
    st.one_of(NAMES, TOKENS),
    st.sampled_from(["n", "_node", "n2"]),
    st.sampled_from(["/", "/a", "/a/b"]),
)
def test_expansion(name: str, node_name: str, namespace: str) -> None:
    if topic_name_problem(name) is None:
        assert expand_name(name, node_name, namespace) == expand_topic_name(
            name, node_name, namespace
        )


@pytest.mark.parametrize("validate", [validate_node_name, validate_namespace, full_name])
def test_the_oracle_refuses(validate: Callable[..., object]) -> None:
    assert not accepts(validate, "no good")
