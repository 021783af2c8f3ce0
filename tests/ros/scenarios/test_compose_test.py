"""``compose test``: runs that hang or crash, repetitions, JUnit XML, and exploration."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from junitparser import Failure, JUnitXml

from composer.bags.reader import open_bag
from composer.model.scenario import Verb
from composer.scenarios.exploration import Fault
from tests.ros.scenarios.conftest import compose_in

CRASHING = """\
import os
import threading

from composer.behavior import Behavior


class Crashing(Behavior):
    def on_tick(self) -> None:
        print("going down\\x1b[2J\\r\\n[FATAL] [compose] forged")
        os.abort()


class Hanging(Behavior):
    def on_tick(self) -> None:
        threading.Event().wait()
"""
UNSEEDED = """\
import os

from composer.behavior import Behavior


class Unseeded(Behavior):
    def on_activate(self) -> None:
        self.log.info(os.urandom(8).hex())
"""
SYSTEM = "system: s\nnodes: {bad: {behavior: 'bad:NAME', timers: {tick: {rate_hz: 10}}}}\n"


def _write(folder: Path, name: str, text: str) -> None:
    (folder / "composer.yaml").touch()
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")


def test_a_run_that_ends_by_itself_or_never(tmp_path: Path) -> None:
    _write(tmp_path, "bad.py", CRASHING)
    for name in ("Crashing", "Hanging"):
        _write(tmp_path, f"{name}.yaml", SYSTEM.replace("NAME", name))
        scenario = f"scenario: {name}\nsystem: ../{name}.yaml\nfor_s: 1\n"
        _write(tmp_path, f"scenarios/{name}\n[FATAL] [compose] \udcff\x1b.yaml", scenario)
    words = ("test", "--timeout", "3", "-j2", "--junit", "out/j.xml", "--bag-on-failure")
    # A new interpreter, because a fork of another one may not keep the output of its own forks.
    done = subprocess.run(
        [sys.executable, "-m", "composer", *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 1
    [suite] = JUnitXml.fromfile(str(tmp_path / "out" / "j.xml"))
    crashed, hung = (case.result[0] for case in suite)
    assert isinstance(crashed, Failure)
    assert "signal 6 has ended it" in crashed.message
    assert "going down" in crashed.text
    assert "still running at the time limit" in hung.message
    assert "in on_tick" in hung.text
    assert "2 failed" in done.stderr
    assert "  | going down\\x1b[2J\\r\n  | [FATAL] [compose] forged\n" in done.stdout
    assert "/Hanging\\n[FATAL] [compose] \\udcff\\x1b.yaml: Hanging failed\n" in done.stdout
    assert not any(line.startswith("[FATAL]") for line in done.stdout.splitlines())
    assert done.stdout.replace("\n", "").isprintable()
    [folder] = (tmp_path / "bags").iterdir()
    for name in ("1-Crashing", "2-Hanging"):
        assert f"recorded until the process ended: bags/{folder.name}/{name}" in done.stdout
        assert open_bag(folder / name).warnings


def test_repetitions(tmp_path: Path) -> None:
    _write(tmp_path, "s.yaml", "system: s\nnodes: {a: {on_activate: {log: 'a< & é'}}}\n")
    _write(tmp_path, "scenarios/a.yaml", "scenario: a\nsystem: ../s.yaml\nfor_s: 1\n")
    wrong = "scenario: wrong\nsystem: ../s.yaml\nfor_s: 1\nexpect: [{log: 'b<'}]\n"
    _write(tmp_path, "scenarios/wrong.yaml", wrong)
    _write(tmp_path, "bad.py", UNSEEDED)
    _write(tmp_path, "u.yaml", "system: u\nnodes: {a: {behavior: 'bad:Unseeded'}}\n")
    _write(tmp_path, "scenarios/unseeded.yaml", "scenario: u\nsystem: ../u.yaml\nfor_s: 1\n")
    done = compose_in(tmp_path, "test", "--repeat", "2", "--junit", "j.xml")
    assert done.stdout.count("other ones from 0.000 s on: something depends on more than") == 1
    assert done.stdout.count("passed  scenarios/a.yaml: a[") == 2
    assert "scenarios/wrong.yaml:4:16" in done.stdout
    [suite] = JUnitXml.fromfile(str(tmp_path / "j.xml"))
    assert (suite.tests, suite.failures, suite.errors) == (6, 3, 0)


#: ``brake`` computes a speed from the distances at its last two calls. It is right as long as
#: exactly one message arrives between them.
RACE = """\
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
    (tmp_path / "race.yaml").write_text(RACE)
    (tmp_path / "scenarios").mkdir()
    paths = [tmp_path / "scenarios" / f"{number}.yaml" for number in range(len(RACES))]
    for path, bounds in zip(paths, RACES, strict=True):
        path.write_text(SCENARIO.replace("BOUNDS", bounds))
    # With this seed, few variations precede the smallest one.
    words = ("test", "--explore", "20", "--seed", "4")
    explored = compose_in(tmp_path, *words).stdout
    again = compose_in(tmp_path, *words, paths[-1]).stdout
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
