"""The time that validating takes grows with the size of a file, also of one full of mistakes."""

from __future__ import annotations

import gc
import itertools
from collections.abc import Callable
from pathlib import Path

import pytest

from composer.loading import load, load_bytes
from tests.unit.support.growth import assert_fast, assert_linear

SMALL, LARGE = 25, 300
#: From 500 names on, each comparison takes longer, by a constant. Comparing names is fast.
OTHER_LARGE = {"remappings misspelt": 200, "nodes left out": 2_000}
STRING = "type: std_msgs/msg/String"
NODES = f"  node_#: {{publishers: {{a: {{{STRING}}}}}, subscriptions: {{x: {{{STRING}}}}}}}\n"
PORTS = f"      port_#: {{{STRING}}}\n"
IMAGE = "type: sensor_msgs/msg/Image, topic: /t, qos: command"
DEADLINE = f"{STRING}, topic: /t, qos: {{deadline_ms"

#: By name: parts of a file, each a heading and a line that is there once for every number; and a
#: rule that finds something in it.
SYSTEMS: dict[str, tuple[list[tuple[str, str]], str]] = {
    "nothing much": (
        [
            ("nodes:\n", NODES),
            ("connections:\n", "  - {topic: /t_#, from: node_#.a, to: node_#.x}\n"),
        ],
        "qos-implicit",
    ),
    "nodes misspelt": (
        [
            ("nodes:\n", NODES),
            ("connections:\n", "  - {topic: /t_#, from: nod_#.a, to: nide_#.x}\n"),
        ],
        "unknown-node",
    ),
    "topics misspelt": (
        [
            ("nodes:\n", f"  talker_#: {{publishers: {{p: {{{STRING}, topic: /topic_#}}}}}}\n"),
            ("", f"  listener_#: {{subscriptions: {{s: {{{STRING}, topic: /topik_#}}}}}}\n"),
        ],
        "subscription-without-publisher",
    ),
    "profiles misspelt": (
        [
            ("qos_profiles:\n", "  profile_#: {depth: 1}\n"),
            ("nodes:\n", f"  node_#: {{publishers: {{p: {{{STRING}, qos: profil_#}}}}}}\n"),
        ],
        "undeclared-name",
    ),
    "one node with many ports": (
        [("nodes:\n  one:\n    publishers:\n", f"      port_#: {{{STRING}}}\n")],
        "publisher-without-subscription",
    ),
    "remappings misspelt": (
        [
            ("nodes:\n  one:\n    executable: {package: a, name: b}\n    publishers:\n", PORTS),
            ("    remappings:\n", "      porto_#: topic_#\n"),
        ],
        "unknown-remapping",
    ),
    "sensor streams on one topic": (
        [
            (
                "nodes:\n",
                f"  node_#: {{publishers: {{p: {{{IMAGE}}}}}, "
                "timers: {t: {rate_hz: 30, publish: {p: {}}}}}\n",
            ),
            ("", f"  other_#: {{subscriptions: {{s: {{{IMAGE}}}}}}}\n"),
        ],
        "unsuited-qos",
    ),
    "deadlines on one topic": (
        [
            ("nodes:\n", f"  node_#: {{publishers: {{p: {{{DEADLINE}: 10#}}}}}}}}\n"),
            ("", f"  other_#: {{subscriptions: {{s: {{{DEADLINE}: 0.#1}}}}}}}}\n"),
        ],
        "qos-incompatible",
    ),
    "deadlines that match": (
        [
            ("nodes:\n", f"  node_#: {{publishers: {{p: {{{DEADLINE}: 0.#1}}}}}}}}\n"),
            ("", f"  other_#: {{subscriptions: {{s: {{{DEADLINE}: 10#}}}}}}}}\n"),
        ],
        "unused-declaration",
    ),
    "states": (
        [
            ("nodes:\n  one:\n    state:\n", "      state_#: 0\n"),
            ("    timers:\n", "      t_#: {rate_hz: 1, set: {state_#: '{state.state_# + 1}'}}\n"),
        ],
        "unused-declaration",
    ),
    "timers with parameters": (
        [
            ("nodes:\n  one:\n    parameters:\n", "      rate_#: 1.0\n"),
            ("    timers:\n", "      t_#: {rate_hz: '{parameters.rate_#}', log: x}\n"),
        ],
        "unused-declaration",
    ),
    "nodes left out": (
        [
            (
                "arguments: {x: {default: false}}\n"
                f"nodes:\n  b: {{publishers: {{a: {{{STRING}}}}}}}\n",
                f"  node_#: {{if: x, publishers: {{a: {{{STRING}}}}}}}\n",
            ),
            ("connections:\n", "  - {topic: /t, from: [b.a, node_#.a]}\n"),
        ],
        "qos-implicit",
    ),
    "one that all wait for": (
        [("nodes:\n  first: {}\n", "  node_#: {lifecycle: {depends_on: [first]}}\n")],
        "unused-declaration",
    ),
}


def write(path: Path, parts: list[tuple[str, str]], count: int) -> None:
    lines = ["system: large\nexecutors: {unused: {kind: single_threaded}}\n"]
    for heading, line in parts:
        lines += [heading, *(line.replace("#", str(number)) for number in range(count))]
    path.write_text("".join(lines))


@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_growth(tmp_path: Path, name: str) -> None:
    parts, rule = SYSTEMS[name]
    large = OTHER_LARGE.get(name, LARGE)
    for count in (SMALL, large):
        write(tmp_path / f"{count}.yaml", parts, count)

    def validate(count: int) -> None:
        loading = load(tmp_path / f"{count}.yaml")
        assert rule in {diagnostic.rule.name for diagnostic in loading.diagnostics}

    assert_linear(validate, SMALL, large)


PORT = f"{{{STRING}, qos: command, external: true}}"
NODE = f"{{publishers: {{a: {PORT}}}, lifecycle: {{depends_on: [first]}}}}"


def written(count: int) -> str:
    nodes = "".join(f"  n{number}: {NODE}\n" for number in range(count - 1))
    return f"nodes:\n  first: {{publishers: {{a: {PORT}}}}}\n{nodes}"


def copied(count: int) -> str:
    return f"{written(1)}  n${{i}}: {{for_each: {{i: {count - 1}}}, {NODE[1:]}\n"


def included(count: int) -> str:
    place = "prefix: 'p${i}_', namespace: 'p${i}'"
    return f"include: [{{for_each: {{i: {count // 5}}}, file: part.yaml, {place}}}]\n"


@pytest.mark.slow
@pytest.mark.parametrize("nodes", [written, copied, included])
def test_many_valid_nodes(tmp_path: Path, nodes: Callable[[int], str]) -> None:
    (tmp_path / "part.yaml").write_text(f"system: part\n{written(5)}")

    def validate(count: int) -> None:
        text = f"system: large\n{nodes(count)}"
        loading = load_bytes(text.encode(), tmp_path, shown="large.yaml")
        assert loading.system is not None
        assert len(loading.system.nodes) == count
        assert loading.diagnostics == []

    assert_linear(validate, 60, 720)


PUBLISHERS = ", ".join(f"p{n}: {{{STRING}}}" for n in range(8))
REACTIONS = ", ".join(
    f"s{n}: {{{STRING}, topic: /t#_{n}, publish: {{p{n}: {{}}}}}}" for n in range(8)
)
TIMERS = ", ".join(
    f"t{n}: {{rate_hz: 2, publish: {{p{n}: {{data: 'x{{count}}'}}}}}}" for n in range(8)
)

#: By name: the begin of a file, a part that is repeated up to the size, and the end. A ``#`` in it
#: is the number of the part.
LARGE_FILES: dict[str, tuple[str, str, str]] = {
    "nodes in one line": ("nodes: {", "n#: {}, ", "}\n"),
    "unknown keys in one line": ("nodes: {", "a#: {b#: 1}, ", "}\n"),
    "unknown sections": ("nodes: {x: {}}\n", "k#: 1\n", ""),
    "QoS overrides": (
        f"nodes:\n  x:\n    publishers: {{p: {{{STRING}}}}}\n    parameters:\n",
        "      qos_overrides./t#.publisher.depth: 3\n",
        "",
    ),
    "a deep namespace": ("nodes: {x: {namespace: '", "/a#", " !'}}\n"),
    "one namespace": ("nodes:\n", "  n#: {namespace: a b}\n", ""),
    "keys without values": ("nodes: {", "a#, ", "}\n"),
    "maps of nothing": ("nodes: {x: {state: {a: [", "{a: }, ", "]}}}\n"),
    "braces": ("nodes: {x: {on_activate: {log: '", "} ", "'}}}\n"),
    "expressions": ("nodes: {x: {on_activate: {log: '", "{a#} ", "'}}}\n"),
    "quotes in braces": ('nodes: {x: {on_activate: {log: "', "{'} ", '"}}}\n'),
    "variables": ("nodes: {x: {on_activate: {log: '", "${a#} ", "'}}}\n"),
    "escapes": ("nodes: {x: {state: {a: [", '"\\a", ', "]}}}\n"),
    "ignored rules": ("nodes: {x: {}} # compose: ignore[", "RC5#, ", "]\n"),
    "ignore comments in quotes": ("nodes: {x: {}} ", "# compose: ignore[", "'\"\n"),
    "misspelt types": ("nodes:\n", "  n#: {publishers: {t: {type: std_msgs/msg/Flot#}}}\n", ""),
    "state": ("nodes:\n  x:\n    state:\n", "      a#: 1\n", ""),
    "executors": ("nodes: {x: {}}\nexecutors:\n", "  e#: {}\n", ""),
    "combinations": (
        "arguments: {a: false, b: false, c: false, d: false, e: false, f: false}\nnodes:\n",
        "  n#: {if: a or f, executor: fast}\n",
        "",
    ),
    "choices": (
        "arguments: {a: {choices: [",
        "c#, ",
        "c]}}\nnodes: {n: {on_activate: {log: '${a}'}}}\n",
    ),
    "arguments": ("nodes: {x: {executor: fast}}\narguments:\n", "  a#: {choices: [x]}\n", ""),
    "frames": ("nodes:\n  x:\n    transforms:\n      static:\n", "        f#: {parent: g#}\n", ""),
    "missing includes": ("nodes: {x: {}}\ninclude:\n", "  - no#.yaml\n", ""),
    "missing modules": ("nodes:\n", "  n#: {behavior: no_module#:Node}\n", ""),
    "many ports": (
        "nodes:\n",
        f"  n#: {{publishers: {{{PUBLISHERS}}}, subscriptions: {{{PUBLISHERS}}}}}\n",
        "",
    ),
    "reactions": (
        "nodes:\n",
        f"  n#: {{publishers: {{{PUBLISHERS}}}, subscriptions: {{{REACTIONS}}}}}\n",
        "",
    ),
    "timers": ("nodes:\n", f"  n#: {{publishers: {{{PUBLISHERS}}}, timers: {{{TIMERS}}}}}\n", ""),
    "one topic": (
        "nodes:\n",
        f"  n#: {{publishers: {{p: {{{STRING}, topic: /t}}}}, "
        f"subscriptions: {{s: {{{STRING}, topic: /t}}}}}}\n",
        "",
    ),
}


def large_file(begin: str, part: str, end: str, size: int) -> bytes:
    count = size // len(part.replace("#", "10000"))
    parts = "".join(part.replace("#", str(number)) for number in range(count))
    return f"system: large\n{begin}{parts}{end}".encode()


@pytest.mark.slow
@pytest.mark.parametrize(("begin", "part", "end"), LARGE_FILES.values(), ids=LARGE_FILES)
def test_large_files(tmp_path: Path, begin: str, part: str, end: str) -> None:
    """Also beyond the limits."""
    numbers = itertools.count()

    def validate(size: int) -> None:
        comment = f"# {next(numbers)}\n"  # the tree of the same small file would be kept
        content = large_file(begin, part, end, size) + comment.encode()
        load_bytes(content, tmp_path, shown="large.yaml")

    assert_linear(validate, 10_000, 100_000)


#: Two seconds of a processor that runs the fixed loop in 0.033 s.
LOOPS_PER_MEGABYTE = 2 / 0.033


@pytest.mark.soak
@pytest.mark.timeout(300)
@pytest.mark.parametrize(("begin", "part", "end"), LARGE_FILES.values(), ids=LARGE_FILES)
def test_the_time_for_a_megabyte(tmp_path: Path, begin: str, part: str, end: str) -> None:
    content = large_file(begin, part, end, 1_000_000)
    load_bytes(large_file(begin, part, end, 1_000), tmp_path, shown="small.yaml")
    assert_fast(lambda: load_bytes(content, tmp_path, shown="large.yaml"), LOOPS_PER_MEGABYTE)


SECTION = "/n#: {ros__parameters: {a: 1}}\n"


def test_parameters_for_many_programs(tmp_path: Path) -> None:
    sections = (SECTION.replace("#", str(number)) for number in range(5_000))
    (tmp_path / "parameters.yaml").write_text("".join(sections))
    nodes = "  p${i}: {for_each: {i: 1000}, executable: {package: a, name: b}}\n"
    text = f"system: large\nparameter_files: parameters.yaml\nnodes:\n{nodes}"
    loading = load_bytes(text.encode(), tmp_path, shown="large.yaml")
    assert loading.diagnostics[-1].message == (
        "with this node, the nodes get more than 1,000,000 sections of parameter files, "
        "counting each node again"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("section", "part"),
    [
        ("expect", "  - {message: /t, where: message.data == 'x#', within_s: 0.5}\n"),
        ("steps", "  - {publish: {/t: {data: hello #}}}\n"),
        ("steps", "  - {when: {log: 'x#'}, drop: {/t: {count: 1}}}\n"),
        ("expect", "  - {state: {n#: active}}\n"),
    ],
)
def test_large_scenarios(tmp_path: Path, section: str, part: str) -> None:
    port = f"{{{STRING}, topic: /t, qos: command}}"
    (tmp_path / "small.yaml").write_text(
        f"system: small\nnodes: {{n: {{publishers: {{p: {port}}}, subscriptions: {{s: {port}}}}}}}"
    )

    def validate(size: int) -> None:
        parts = "".join(part.replace("#", str(number)) for number in range(size // len(part)))
        content = f"scenario: s\nsystem: small.yaml\nfor_s: 9\n{section}:\n{parts}".encode()
        loading = load_bytes(content, tmp_path, shown="scenario.yaml")
        assert loading.system is not None

    assert_linear(validate, 8_000, 80_000)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("declaring", "system"),
    [
        ("node: part\nvariables:\n", "nodes: {n: {type: part}}\n"),
        ("system: part\nnodes: {n: {}}\narguments:\n", "include: [nodes/part.yaml]\n"),
    ],
    ids=["variables", "arguments"],
)
def test_many_missing_values(tmp_path: Path, declaring: str, system: str) -> None:
    def validate(count: int) -> None:
        folder = tmp_path / str(count)
        (folder / "nodes").mkdir(parents=True, exist_ok=True)
        (folder / "composer.yaml").touch()
        names = "".join(f"  v{number}: {{description: speed}}\n" for number in range(count))
        (folder / "nodes" / "part.yaml").write_text(f"{declaring}{names}")
        loading = load_bytes(f"system: large\n{system}".encode(), folder, shown="large.yaml")
        rules = [diagnostic.rule.name for diagnostic in loading.diagnostics]
        assert rules.count("missing-variable") >= min(count, 400)

    assert_linear(validate, 60, 480)


NODE_TYPE = "node: big\npublishers:\n" + "".join(f"  p{n}: {{{STRING}}}\n" for n in range(400))
PARAMETERS = ", ".join(f"a{number}: 1" for number in range(5_001))
FRAMES = ", ".join(f"f{number}: {{parent: map}}" for number in range(5_001))
LOG = f"log: '{{{' + '.join(['1'] * 30)}}}'"
TOO_MANY_VALUES = (
    "with this node, the nodes declare more than 300,000 values, counting expressions by "
    "their length"
)


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        (f"x: {{parameters: {{{PARAMETERS}}}}}", "'parameters' has more than 5,000 entries"),
        (f"x: {{transforms: {{static: {{{FRAMES}}}}}}}", "'static' has more than 5,000 entries"),
        (
            f"n${{i}}: {{for_each: {{i: 2500}}, on_activate: {{{LOG}}}, on_configure: {{{LOG}}}}}",
            TOO_MANY_VALUES,
        ),
        ("n${i}: {for_each: {i: 1000}, type: big}", TOO_MANY_VALUES),
    ],
)
def test_a_small_file_that_stands_for_much(tmp_path: Path, nodes: str, message: str) -> None:
    folder = tmp_path / "nodes"
    folder.mkdir()
    (folder / "big.yaml").write_text(NODE_TYPE)
    loading = load_bytes(f"system: a\nnodes:\n  {nodes}\n".encode(), tmp_path, shown="a.yaml")
    assert [item.message for item in loading.diagnostics] == [message]


def test_loading_pauses_the_cycle_collection_only_while_it_runs(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(f"system: a\n{written(100)}")
    collections: list[str] = []
    gc.callbacks.append(lambda phase, _: collections.append(phase))
    try:
        before = gc.isenabled()
        load(tmp_path / "a.yaml")
        assert gc.isenabled() == before
    finally:
        gc.callbacks.pop()
    # One may start when they are enabled again; without the pause there are several.
    assert collections in ([], ["start", "stop"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["/**/n#", "/**", "/**/m#/*"])
def test_many_names_in_parameter_files(tmp_path: Path, name: str) -> None:
    def validate(count: int) -> None:
        nodes = "".join(f"  n{number}: {{parameters: {{a: 1.0}}}}\n" for number in range(count))
        sections = (
            f"{name.replace('#', str(number))}: {{ros__parameters: {{a: 2.0}}}}\n---\n"
            for number in range(count)
        )
        (tmp_path / "parameters.yaml").write_text(f"{''.join(sections)}/n0: {{}}\n")
        text = f"system: large\nparameter_files: parameters.yaml\nnodes:\n{nodes}"
        loading = load_bytes(text.encode(), tmp_path, shown="large.yaml")
        assert loading.system is not None

    assert_linear(validate, 50, 500)
