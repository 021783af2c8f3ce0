"""A node type whose behavior has every kind of port, for tests of behavior tests."""

from __future__ import annotations

#: Interfaces of the project: no Python class is built for them.
INTERFACES = {
    "package.xml": "<package format='3'><name>lab</name></package>",
    "msg/Level.msg": "uint8 HIGH=3\nfloat64 value\nuint8 kind\nstring[<=2] notes\nint32[3] codes\n",
    "msg/Tank.msg": "Level level\nbuiltin_interfaces/Time stamp\n",
    "srv/Fill.srv": "float64 amount\n---\nbool success\nstring message\n",
    "srv/Read.srv": "---\nfloat64 value\n",
    "action/Drain.action": "float64 amount\n---\nfloat64 rest\n---\nfloat64 done\n",
}
TANK = """\
node: tank
behavior: tank:Tank
variables: {depth: {default: 2}}
parameters:
  rate_hz: {type: double, default: 10.0, minimum: 1.0, maximum: 100.0, unit: Hz}
  size: {type: double, default: 5.0, minimum: 0.0, step: 0.5}
  mode: {type: string, default: slow, choices: [slow, fast]}
  codes: {type: integer_array, default: [1, 2], read_only: true}
publishers:
  tanks: {type: lab/msg/Tank, qos: command}
subscriptions:
  levels: {type: lab/msg/Level, qos: {depth: "${depth}"}}
  states: {type: lab/msg/Level, qos: state}
  open: {type: lab/msg/Level}
  run: {type: lab/msg/Level}
services:
  fill: {type: lab/srv/Fill}
  read: {type: lab/srv/Read, always_on: true}
clients:
  valve: {type: lab/srv/Fill, timeout_ms: 1000}
action_servers:
  drain: {type: lab/action/Drain}
action_clients:
  pump: {type: lab/action/Drain, timeout_ms: 1000}
timers:
  tick: {rate_hz: "{parameters.rate_hz}"}
"""
BEHAVIOR = """\
from composer.behavior import CallError, TransitionFailed


class Tank:
    calls = ()

    def note(self, text):
        self.calls = (*self.calls, text)

    def on_configure(self): self.note("configure")
    def on_deactivate(self): self.note("deactivate")
    def on_cleanup(self): self.note("cleanup")
    def on_shutdown(self): self.note("shutdown")

    def on_error(self, cause):
        self.note(f"error: {cause}")

    def on_activate(self):
        self.note("activate")
        if self.parameters.mode == "fast":
            raise TransitionFailed("not yet")
        if self.parameters.size == 0.0:
            raise OSError("no tank")

    def on_parameters(self, changes):
        self.note(changes)

    def on_tick(self):
        Tank = self.publishers.tanks.message_type
        message = Tank(stamp=self.clock.stamp())
        message.level.value = self.parameters.size
        self.publishers.tanks.publish(message)

    async def on_levels(self, message):
        self.note(message.value)
        if message.kind == message.HIGH:
            self.fail("overflow")
        await self.clock.sleep(message.value)

    def on_states(self, message):
        self.note(message.value)
        if message.value < 0.0:
            self.publishers.tanks.message_type().level.value / 0.0

    def on_fill(self, request, response):
        if request.amount < 0.0:
            raise ValueError("negative")
        response.success = request.amount <= self.parameters.size
        return response

    async def on_read(self, request, response):
        await self.clock.sleep(0.5)
        response.value = 1.5
        return response

    def accept_drain(self, request):
        return request.amount > 0.0

    async def on_drain(self, goal):
        action = self.action_clients.pump.action_type
        for step in range(1, 5):
            await self.clock.sleep(0.25)
            if goal.is_cancel_requested:
                break
            goal.publish_feedback(action.Feedback(done=goal.request.amount * step / 4))
            if goal.request.amount > 100.0:
                raise RuntimeError("leak")
        return action.Result(rest=0.0)

    async def on_open(self, message):
        try:
            request = self.clients.valve.service_type.Request(amount=1.0)
            self.note((await self.clients.valve.call(request)).message)
        except CallError as error:
            self.note(type(error).__name__)

    async def on_run(self, message):
        try:
            goal = self.action_clients.pump.action_type.Goal(amount=1.0)
            sent = await self.action_clients.pump.send_goal(
                goal, on_feedback=lambda feedback: self.note(feedback.done)
            )
            if message.kind == message.HIGH:
                await self.clock.sleep(0.15)
                self.note(await sent.cancel())
            ended = await sent.result()
            self.note((ended.status, ended.result.rest))
        except CallError as error:
            self.note(type(error).__name__)
"""
