"""``compose test --explore`` finds a race in a system of two nodes, and shrinks it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from composer.model.scenario import Verb
from composer.scenarios.exploration import Fault
from tests.ros.scenarios.conftest import compose_in

#: ``brake`` computes a speed from the distances at its last two calls. It is right as long as
#: exactly one message arrives between them.
SYSTEM = """\
system: race
nodes:
  sensor:
    publishers: {distance: {type: std_msgs/msg/Float64, qos: command}}
    timers:
      measure: {rate_hz: 20, publish: {distance: {data: "{9.0 - 0.1 * count}"}}}
  brake:
    state: {distance: 9.0, before: 9.0, speed: 0.0}
    subscriptions:
      distance:
        type: std_msgs/msg/Float64
        qos: command
        set: {distance: "{message.data}"}
    publishers: {speed: {type: std_msgs/msg/Float64, qos: command, external: true}}
    timers:
      decide:
        rate_hz: 20
        set:
          speed: "{(state.before - state.distance) / 0.05}"
          before: "{state.distance}"
        publish: {speed: {data: "{state.speed}"}}
connections:
  - {topic: /distance, from: sensor.distance, to: brake.distance}
  - {topic: /speed, from: brake.speed}
"""
SCENARIO = """\
scenario: race
system: ../race.yaml
for_s: 0.5
explore: BOUNDS
expect:
  - {silence: /speed, where: message.data > 3}
"""
#: Bounds, and the smallest variation within them with which the scenario fails.
RACES = {
    "{jitter_ms: 10}": "call 3 of timer brake.decide is 0.1 ms late",
    "{reorder: 1, topics: [/distance]}": "messages 1 and 2 of /distance are swapped",
}


@pytest.mark.parametrize(
    ("fault", "text", "yaml"),
    [
        (
            Fault(Verb.DROP, "/scan", count=1, first=3),
            "message 3 of /scan is lost",
            "- drop: {/scan: {skip: 2, count: 1}}",
        ),
        (
            Fault(Verb.REORDER, "/scan", count=2, first=1),
            "messages 1 to 4 of /scan are swapped in pairs",
            "- reorder: {/scan: {count: 4}}",
        ),
        (
            Fault(Verb.DELAY, "/scan", count=10, first=11, by_s=0.00005),
            "messages 11 to 20 of /scan are 0.05 ms late",
            "- delay: {/scan: {by_s: 0.00005, skip: 10, count: 10}}",
        ),
    ],
)
def test_words(fault: Fault, text: str, yaml: str) -> None:
    assert (str(fault), fault.yaml) == (text, yaml)


def test_a_race_is_found_and_can_be_repeated(tmp_path: Path) -> None:
    (tmp_path / "composer.yaml").touch()
    (tmp_path / "race.yaml").write_text(SYSTEM)
    (tmp_path / "scenarios").mkdir()
    paths = [tmp_path / "scenarios" / f"{number}.yaml" for number in range(len(RACES))]
    for path, bounds in zip(paths, RACES, strict=True):
        path.write_text(SCENARIO.replace("BOUNDS", bounds))
    explored = compose_in(tmp_path, "test", "--explore", "20", "--seed", "4").stdout
    again = compose_in(tmp_path, "test", "--explore", "20", "--seed", "4", str(paths[-1])).stdout
    reports = explored.split("race failed\n")[1:]
    assert again.split("race failed\n")[1] == reports[-1]
    for path, report, text in zip(paths, reports, RACES.values(), strict=True):
        assert report.startswith(f"it fails with:\n    {text}\nto repeat it, add this")
        block = re.findall("^    (.*)\n", report.partition(" -->")[0], re.MULTILINE)[1:]
        assert block[0] == "seed: 4"
        path.write_text("\n".join([path.read_text(), *block]))
    seen = re.findall("seen: .*", explored)
    assert len(seen) == len(RACES)
    assert re.findall("seen: .*", compose_in(tmp_path, "test").stdout) == seen
    assert {path.name for path in tmp_path.iterdir()} == {"composer.yaml", "race.yaml", "scenarios"}


def test_where_nothing_varies_but_the_seed(tmp_path: Path) -> None:
    (tmp_path / "race.yaml").write_text(
        "system: race\nnodes: {node: {on_activate: {log: started}}}\n"
    )
    scenario = SCENARIO.replace("BOUNDS", "{jitter_ms: 5, drop: 1, reorder: 1}")
    path = tmp_path / "scenario.yaml"
    path.write_text(scenario.partition("expect:")[0].replace("../race", "race"))
    done = compose_in(tmp_path, "test", "--explore", "2", str(path))
    assert re.fullmatch("passed .*, 2 variations\n", done.stdout)
