"""A system with nodes for every kind of fault, and one that must not be affected."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import dedent

TRANSITIONS = ("configure", "activate", "deactivate", "cleanup", "shutdown", "error")
CALLBACKS = ("tick", "input", "ask", "drive", "parameters")
PLACES = (*TRANSITIONS, *CALLBACKS)
#: What a callback does; each except ``hang`` has a node.
FAULTS = ("raise", "none", "nonsense", "exit", "once")
#: Hanging nodes have an executor each, which they block.
HANGING = tuple(f"hang_{place}" for place in PLACES)
#: Alone, the control.
METRONOME = """
system: faulty
lifecycle: {on_failure: isolate}
executors: {calm: {kind: events}}
nodes:
  metronome:
    executor: calm  # creating and destroying endpoints takes time on an executor
    publishers: {beat: {type: std_msgs/msg/Int64, external: true}}
    timers: {beat: {period_ms: 100, publish: {beat: {data: "{count}"}}}}
"""
NODE = """
  NAME:
    EXECUTOR
    behavior: faulty:Faulty
    parameters: {fault: ""}
    subscriptions: {input: {type: std_msgs/msg/String, topic: ~/input, external: true}}
    services: {ask: {type: std_srvs/srv/Trigger, service: ~/ask, external: true}}
    action_servers:
      drive: {type: composer_interfaces/action/Navigate, action: ~/drive, external: true}
    timers: {tick: {period_ms: 50}}
    lifecycle: {timeout_ms: 2500, watch: {callback_ms: 300}}
"""
MODULE = '''
import time
from composer.behavior import Behavior

DONE = set()


class Faulty(Behavior):
    """Fails in one callback as the parameter ``fault`` says: ``activate raise``."""

    def act(self, place, good=None):
        faulty, _, fault = self.parameters.fault.partition(" ")
        if place == "configure" and faulty == "error":
            raise ValueError("the cause")
        if place != faulty:
            return good
        again = (self.name, place) in DONE
        if not again:
            DONE.add((self.name, place))
            self.log.info(f"{place} acts")
        if fault == "raise" or (fault == "once" and not again):
            raise ValueError("broken")
        if fault == "exit":
            raise SystemExit("out")
        if fault == "nonsense":
            return "nonsense"
        if fault == "none":
            return None
        while fault == "hang":
            time.sleep(0.01)  # hang without using the CPU
        if (self.name, place, "works") not in DONE:
            DONE.add((self.name, place, "works"))
            self.log.info(f"{place} works again")
        return good

    def on_configure(self):
        return self.act("configure")

    def on_activate(self):
        return self.act("activate")

    def on_deactivate(self):
        return self.act("deactivate")

    def on_cleanup(self):
        return self.act("cleanup")

    def on_shutdown(self):
        return self.act("shutdown")

    def on_error(self, cause):
        self.log.info(f"the cause is {type(cause).__name__}")
        return self.act("error")

    def on_tick(self):
        return self.act("tick")

    def on_input(self, message):
        return self.act("input")

    def on_ask(self, request, response):
        response.success = True
        return self.act("ask", response)

    def on_drive(self, goal):
        return self.act("drive")

    def on_parameters(self, changes):
        return self.act("parameters")
'''


def write_faulty_system(folder: Path, names: Sequence[str] = (*FAULTS, *HANGING)) -> Path:
    """Write a system with nodes of these names, and their behavior; return its path."""
    executors = "".join(f", {name}: {{kind: events}}" for name in names if name in HANGING)
    nodes = (
        NODE.replace("NAME", name).replace("EXECUTOR", f"executor: {name}")
        if name in HANGING
        else NODE.replace("NAME", name).replace("    EXECUTOR\n", "")
        for name in names
    )
    path = folder / "faulty.yaml"
    text = METRONOME.replace("events}}", f"events}}{executors}}}")
    path.write_text(text + "".join(nodes), encoding="utf-8")
    path.with_suffix(".py").write_text(dedent(MODULE), encoding="utf-8")
    return path
