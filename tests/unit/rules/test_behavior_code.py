"""Mistakes in the Python code of behaviors."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.behavior_code import SYSTEM, found
from tests.unit.support.checking import diagnostics_in, quoted

#: The statement, the place that it is in, the rule, the text that is underlined, and a hint.
MISTAKES = [
    # ports and parameters
    ("odometry", "self.publishers.txt.publish(String())", "unknown-attribute", "txt", "'text'"),
    ("odometry", "self.publishers['txt']", "unknown-attribute", "'txt'", "'text'"),
    ("odometry", "self.publishers.stop", "unknown-attribute", "stop", "'clients'"),
    ("odometry", "self.parameters.sped", "unknown-attribute", "sped", "'speed'"),
    ("odometry", "self.parameters.wheel", "unknown-attribute", "wheel", None),
    ("configure", "await self.clients.stp.call(0)", "unknown-attribute", "stp", "'stop'"),
    ("configure", "self.action_clients.trn", "unknown-attribute", "trn", "'turn'"),
    # the API
    ("odometry", "self.publishers.text.send(String())", "unknown-attribute", "send", None),
    ("odometry", "self.log.warning('no')", "unknown-attribute", "warning", "'warn'"),
    ("odometry", "self.clock.time()", "unknown-attribute", "time", None),
    ("drive", "goal.cancel()", "unknown-attribute", "cancel", "'canceled'"),
    ("follow", "goal.is_canceled", "unknown-attribute", "is_canceled", None),
    ("follow", "sent.status", "unknown-attribute", "status", None),
    # the behavior itself
    ("odometry", "self.publisher.text.publish(0)", "unknown-attribute", "publisher", "shers'"),
    ("odometry", "self.cuont += 1", "unknown-attribute", "cuont", "'count'"),
    ("odometry", "self._txet()", "unknown-attribute", "_txet", "'_text'"),
    ("odometry", "self.zebra", "unknown-attribute", "zebra", "no method"),
    # fields
    ("odometry", "message.pose.positon", "unknown-field", "positon", None),
    ("odometry", "message.pose.pose.position.w", "unknown-field", "w", "x, y, z"),
    ("odometry", "message.header.frame = 'odom'", "unknown-field", "frame", "'frame_id'"),
    ("odometry", "header = message.header\nheader.stmp", "unknown-field", "stmp", "'stamp'"),
    ("odometry", "self.last.twst", "unknown-field", "twst", "'twist'"),
    ("odometry", "self.point.w", "unknown-field", "w", None),
    ("odometry", "for pose in Path().poses:\n    pose.pos", "unknown-field", "pos", "'pose'"),
    ("odometry", "Path().poses[0].pos", "unknown-field", "pos", "'pose'"),
    ("odometry", "[p.pos for p in Path().poses]", "unknown-field", "pos", "'pose'"),
    ("odometry", "Path().poses.header", "unknown-field", "header", "use an index"),
    ("odometry", "message.child_frame_id.data", "unknown-field", "data", None),
    ("odometry", "String(dta='x')", "unknown-field", "dta", "'data'"),
    ("odometry", "BatteryState.POWER_SUPPLY_STATUS_FUL", "unknown-field", None, "STATUS_FULL'"),
    ("reset", "response.sucess = True", "unknown-field", "sucess", "'success'"),
    ("reset", "request.data", "unknown-field", "data", None),
    ("drive", "goal.request.targt", "unknown-field", "targt", "'target'"),
    ("drive", "end = Navigate.Result()\ngoal.publish_feedback(end)\nreturn end", "invalid-value",
     "end", None),
    ("drive", "goal.publish_feedback(Navigate.Feedback(x=1))", "unknown-field", "x", None),
    ("drive", "return Navigate.Reslt()", "unknown-field", "Reslt", "'Result'"),
    ("follow", "goal.request.targt", "unknown-field", "targt", "'target'"),
    ("configure", "got = await self.clients.stop.call(Trigger.Request())\ngot.ok", "unknown-field",
     "ok", None),
    ("configure", "point = await self._wait()\npoint.w", "unknown-field", "w", None),
    ("configure", "self.publishers.text.message_type(dat='')", "unknown-field", "dat", None),
    ("function", "stamp.secs", "unknown-field", "secs", "'sec'"),
    # values
    ("odometry", "String(data=5)", "invalid-value", "5", None),
    ("odometry", "String('x')", "invalid-value", "'x'", "data=..."),
    ("odometry", "message.child_frame_id = 5", "invalid-value", "5", None),
    ("odometry", "Time(sec=0.5)", "invalid-value", "0.5", None),
    ("odometry", "PoseStamped(pose=Point())", "invalid-value", "Point()", None),
    ("odometry", "self.publishers.text.publish('x')", "invalid-value", "'x'", None),
    ("odometry", "self.publishers.text.publish(String)", "invalid-value", "String", "String()"),
    ("odometry", "self.publishers.text.publish(self._text)", "invalid-value", None, "_text()"),
    ("odometry", "self.publishers.text.publish(Path())", "invalid-value", "Path()", None),
    ("odometry", "path = Path\npath.header", "invalid-value", "Path", "add '()'"),
    (
        "configure",
        "await self.clients.stop.call(Trigger())",
        "invalid-value",
        "Trigger",
        "Request()",
    ),
    ("odometry", "Point(x=1)", "invalid-value", "1", "write 1.0"),
    ("odometry", "point = Point()\npoint.x, point.y = 1.0, 2", "invalid-value", "2", "write 2.0"),
    ("odometry", "Point(x=True)", "invalid-value", "True", "write 1.0"),
    ("odometry", "Point(x=self.count)", "invalid-value", "self.count", "float(...)"),
    ("odometry", "Point(x=len('a') - 1)", "invalid-value", "len('a') - 1", "float(...)"),
    ("reset", "response.success = self.count", "invalid-value", "self.count", "bool(...)"),
    ("odometry", "Time(sec=3 / 2)", "invalid-value", "3 / 2", "int(...)"),
    ("odometry", "Time(sec=self.clock.now)", "invalid-value", "self.clock.now", "now()"),
    ("odometry", "Path(poses=PoseStamped())", "invalid-value", "PoseStamped()", None),
    ("odometry", "Path(poses=[Point()])", "invalid-value", "Point()", None),
    ("odometry", "Path().poses.append((1.0, 2.0))", "invalid-value", "(1.0, 2.0)", None),
    ("odometry", "String(data=['x'])", "invalid-value", "['x']", None),
    ("odometry", "PoseStamped(pose=self.parameters.speed * 2)", "invalid-value", None, None),
    ("odometry", "self.publishers.text.publish(Path().poses)", "invalid-value", None, None),
    ("odometry", "self.publishers.text(String())", "invalid-value", None, "'publish'"),
    # operations
    ("odometry", "self.clock.stamp() - 0.5", "invalid-value", "self.clock.stamp() - 0.5", None),
    ("odometry", "'a' + self.count", "invalid-value", "'a' + self.count", None),
    ("odometry", "self.parameters.names[self.parameters.speed]", "invalid-value", None, None),
    ("odometry", "len(self.count)", "invalid-value", "self.count", None),
    ("odometry", "message.pose[0]", "invalid-value", "0", None),
    ("odometry", "self.clock.now().to_msg()", "unknown-field", "to_msg", None),
    # classes and collections of the file
    ("odometry", "Mode.FASST", "unknown-attribute", "FASST", "'FAST'"),
    ("odometry", "Statistics().framez", "unknown-attribute", "framez", "'frames'"),
    ("odometry", "self.statistics.average()", "unknown-attribute", "average", None),
    ("odometry", "self.statistics.frame += 1", "unknown-attribute", "frame", "'frames'"),
    ("odometry", "{}.append(1)", "unknown-attribute", "append", None),
    ("odometry", "self.paths = {}\nfor p in self.paths.value():\n    p", "unknown-attribute",
     "value", None),
    ("odometry", "self.declared", "unknown-attribute", "declared", None),
    ("odometry", "self.point = [1.0, 2.0]", "invalid-value", "[1.0, 2.0]", None),
    ("odometry", "if self.parameters.mode == 'fsat':\n    pass", "invalid-value", "'fsat'",
     "'fast'"),
    ("configure", "sent = await self.action_clients.turn.send_goal(Navigate.Goal())\n"
     "ended = await sent.result()\nif ended.status == 'success':\n    pass", "invalid-value",
     "'success'", None),
    ("odometry", "total += 1", "undefined-name", "total", None),
    # calls
    ("odometry", "self.scale()", "call-arguments", "self.scale", None),
    ("odometry", "self.scale(1.0, 'a', 2)", "call-arguments", "2", None),
    ("odometry", "self.scale(1.0, nam='a')", "call-arguments", "nam", "'name'"),
    ("odometry", "self.scale(message)", "call-arguments", "message", None),
    ("odometry", "self.scale('fast')", "call-arguments", "'fast'", None),
    ("odometry", "self.keep_rates([0.1, '0.2'])", "call-arguments", "'0.2'", None),
    ("odometry", "self.statistics.mean(1)", "call-arguments", "1", None),
    ("odometry", "self.publishers.text.publish()", "call-arguments", None, None),
    ("configure", "await self.action_clients.turn.send_goal(Navigate.Goal(), feedback=print)",
     "call-arguments", "feedback", "'on_feedback'"),
    ("configure", "await self.clock.sleep(Time())", "call-arguments", "Time()", None),
    ("odometry", "math.atan2(1.0)", "call-arguments", "math.atan2", None),
    ("odometry", "math.hypot(1.0, 2.0).real, math.sin(1.0, 2.0)", "call-arguments", "2.0", None),
    ("odometry", "range(self.parameters.speed)", "invalid-value", None, "int(...)"),
    ("odometry", "self.count > self.parameters.names", "invalid-value", None, None),
    ("odometry", "self.count > 'a'", "invalid-value", "self.count > 'a'", None),
    ("odometry", "String(data=self.count > 0)", "invalid-value", "self.count > 0", None),
    ("odometry", "self.never += 1\nself.scale(1.0, 'never')", "unknown-attribute", "never", None),
    # numbers of elements
    ("odometry", "self.parameters.names[1]", "index-out-of-range", "1", "last one is 0"),
    ("odometry", "self.parameters.names[-2]", "index-out-of-range", "-2", None),
    ("odometry", "first, second = self.parameters.names", "index-out-of-range", None, None),
    ("odometry", "message.pose.covariance = [0.0] * 6", "invalid-value", "[0.0] * 6", None),
    ("odometry", "message.pose.covariance = [0.0, 1.0]", "invalid-value", "[0.0, 1.0]", None),
    # statements without effect
    ("odometry", "self.count == 1", "unused-result", "self.count == 1", "'='"),
    ("odometry", "self._text", "unused-result", "self._text", "()"),
    ("odometry", "self.staistics = self.statistics", "unused-result", "staistics", "'statistics'"),
    # values of modules, ranges and constructors
    ("function", "for i in range(3):\n    Point(x=i)", "invalid-value", "i", None),
    ("function", "Time(sec=NANOSECONDS / 2)", "invalid-value", "NANOSECONDS / 2", None),
    ("odometry", "Reference(1)", "call-arguments", "Reference", None),
    # asyncio
    ("configure", "await asyncio.sleep(1.0)", "asyncio-call", "asyncio.sleep", "self.clock.sleep"),
    # annotations
    ("odometry", "def inner(x: Navigate.Gaol):\n    pass", "unknown-field", "Gaol", "'Goal'"),
    # awaiting
    ("configure", "self.clock.sleep(1.0)", "missing-await", "self.clock.sleep", "'await'"),
    ("configure", "self._wait()", "missing-await", "self._wait", "'await'"),
    ("configure", "wait(Time())", "missing-await", "wait", "'await'"),
    ("odometry", "self._wait()", "missing-await", "self._wait", "'async def on_odometry'"),
    ("configure", "self._wait().x", "missing-await", "self._wait", None),
    ("configure", "point = self._wait()\npoint.x", "missing-await", "self._wait", None),
    ("configure", "seen = self._wait()\nif seen:\n    pass", "missing-await", None, None),
    ("configure", "x, y = self._wait()", "missing-await", "self._wait", None),
    ("configure", "if self._wait():\n    pass", "missing-await", "self._wait", None),
    ("configure", "text = self._wait()\nself.log.info(f'{text}')", "missing-await", None, None),
    ("configure", "text = self._wait()\nString(data=text)", "missing-await", None, None),
    ("configure", "sent = self.action_clients.turn.send_goal(Navigate.Goal())\n"
     "await sent.result()", "missing-await", "self.action_clients.turn.send_goal", None),
    ("drive", "return self._wait()", "missing-await", "self._wait", None),
    # names that are not defined or cannot be imported
    ("odometry", "self.log.info(mesage)", "undefined-name", "mesage", "'message'"),
    ("odometry", "Twist()", "undefined-name", "Twist", "import it"),
    ("odometry", "random.random()", "undefined-name", "random", "'import random'"),
    ("odometry", "math.sqroot(2)", "unknown-import", "sqroot", "'sqrt'"),
    ("odometry", "import tyme", "unknown-import", "tyme", "'time'"),
    ("odometry", "from composer.behavior import Publishr", "unknown-import", "Publishr", None),
    ("odometry", "from std_msgs.msg import Strng", "unknown-import", "Strng", "'String'"),
    ("odometry", "from std_msgs.srv import Trigger", "unknown-import", "Trigger", None),
    ("odometry", "from std_msgs.mgs import String", "unknown-import", "mgs", "'msg'"),
    ("odometry", "from robot_code import Cod", "unknown-import", "Cod", "'Code'"),
    ("odometry", "from .nowhere import x", "unknown-import", ".nowhere", None),
    ("odometry", "import qwertzuiop", "module-not-installed", "qwertzuiop", None),
    ("odometry", "from composer.names import expand_name", "internal-import", None, None),
    # control flow
    ("reset", "if request:\n    return", "missing-return", "return", "'return response'"),
    ("reset", "return None", "missing-return", "return None", None),
    ("configure", "return ValueError('no')", "unused-result", "ValueError('no')", "'raise'"),
    ("reset", "if request:\n    return True", "invalid-value", "True", None),
    ("reset", "return request", "invalid-value", "request", None),
    ("reset", "return Trigger.Response", "invalid-value", "Trigger.Response", "create it"),
    ("configure", "while True:\n    self.count = 1", "endless-loop", "while", "sleep"),
    ("drive", "while not goal.is_cancel_requested:\n    pass", "endless-loop", "while", None),
    ("drive", "time.sleep(1.0)", "blocking-call", "time.sleep", "self.clock.sleep"),
    # formats
    ("odometry", "'{} of {}'.format(self.count)", "invalid-value", "'{} of {}'", None),
    ("odometry", "'{0} of {2}'.format(1, 2)", "invalid-value", "'{0} of {2}'", None),
    ("odometry", "'{:{width}}'.format(1, size=2)", "invalid-value", "'{:{width}}'", None),
    ("odometry", "'{0} of {}'.format(1, 2)", "invalid-value", "'{0} of {}'", None),
    ("odometry", "'{:.1f}'.format('a')", "invalid-value", "'{:.1f}'", None),
    ("odometry", "'{: of {}'.format(1)", "invalid-value", "'{: of {}'", None),
    ("odometry", "'%d times' % self._text()", "invalid-value", None, None),
    # tuples and loops
    ("odometry", "for index, x, y in enumerate([(1.0, 2.0)]):\n    pass", "invalid-value",
     "enumerate([(1.0, 2.0)])", None),
    ("odometry", "for i, (x, y) in enumerate([(1.0, 2.0)]):\n    String(data=x)",
     "invalid-value", "x", None),
    ("odometry", "for i, name in enumerate(['a']):\n    String(data=i)", "invalid-value", "i",
     None),
    ("odometry", "for a, b in zip(self.parameters.names, [1]):\n    String(data=b)",
     "invalid-value", "b", None),
    ("odometry", "for key, value in {'a': 1}:\n    pass", "invalid-value", "{'a': 1}", ".items()"),
    ("odometry", "for key, value in {'a': 1}.items():\n    String(data=value)", "invalid-value",
     "value", None),
    ("odometry", "for x in message:\n    pass", "invalid-value", "message", None),
    ("odometry", "first, second = message", "invalid-value", "message", None),
    ("odometry", "sum(self.count)", "invalid-value", "self.count", None),
    ("odometry", "self.statistics.scores += message", "invalid-value", "message", None),
    ("odometry", "String(data=min([1.0], default=0.0))", "invalid-value", None, None),
    ("odometry", "min([1.0], 2.0)", "invalid-value", "min([1.0], 2.0)", None),
    ("odometry", "min(message.pose, 2.0)", "invalid-value", None, None),
    ("odometry", "Time(sec=sum([0.5]))", "invalid-value", "sum([0.5])", "int(...)"),
    # collections, texts and exceptions
    ("odometry", "Path().poses.append(Point(), 1)", "invalid-value", None, None),
    ("odometry", "['a'].append('b', 'c')", "call-arguments", "'c'", None),
    ("odometry", "self.statistics.scores.append(message)", "invalid-value", "message", None),
    ("odometry", "names: dict[str, float] = {}\nnames['a'] = message", "invalid-value", "message",
     None),
    ("odometry", "', '.join([1.0])", "invalid-value", "[1.0]", None),
    ("odometry", "String(data='a b'.split())", "invalid-value", "'a b'.split()", None),
    ("odometry", "message.pose.covariance[36] = 0.0", "index-out-of-range", "36", "35"),
    ("odometry", "message.pose.covariance.x", "unknown-field", "x", "use an index"),
    ("odometry", "[0.5] * 0.1", "invalid-value", "[0.5] * 0.1", None),
    ("odometry", "divmod(1.0)", "call-arguments", "divmod", None),
    ("odometry", "self.first()", "call-arguments", "self.first", None),
    ("odometry", "self.scale > 1.0", "invalid-value", None, None),
    ("odometry", "message.pose > 1.0", "invalid-value", None, None),
    ("odometry", "try:\n    pass\nexcept OSError as error:\n    error.message",
     "unknown-attribute", "message", "str(...)"),
    # classes with fields
    ("odometry", "Statistics(1, [0.1], 2)", "call-arguments", "2", None),
    ("odometry", "Statistics(frame=1)", "call-arguments", "frame", "'frames'"),
    ("odometry", "Statistics(frames='a')", "call-arguments", "'a'", None),
    ("odometry", "String(data=self.statistics)", "invalid-value", "self.statistics", None),
    ("odometry", "self.statistics(1)", "invalid-value", "self.statistics", None),
    # bytes
    ("odometry", "DiagnosticStatus(level=2)", "invalid-value", "2", "bytes([2])"),
    ("odometry", "DiagnosticStatus(level=self.count)", "invalid-value", "self.count", None),
    ("odometry", "DiagnosticStatus(name=DiagnosticStatus.OK)", "invalid-value", None, None),
    ("odometry", "DiagnosticStatus().level = 1 if message else DiagnosticStatus.OK",
     "invalid-value", "1", None),
    # numbers of different size, and values that rest on themselves
    ("odometry", "self.rate = 0.5\nself.rate = BatteryState().voltage\nString(data=self.rate)",
     "invalid-value", "self.rate", None),
    ("odometry", "path = Path()\npath.poses += PoseStamped()", "invalid-value", "PoseStamped()",
     None),
    ("odometry", "self.count = (self.count + 1) % 5\nString(data=self.count)", "invalid-value",
     "self.count", None),
    # attributes that change
    ("odometry", "self.count = message", "attribute-kind", "message", "annotate"),
    ("odometry", "self.count = message.pose.covariance", "attribute-kind", None, None),
    ("odometry", "self.statistics = [0.1]", "attribute-kind", "[0.1]", None),
    # values that may be None
    ("odometry", "points = {'a': Point()}\npoints.get('b').x", "unchecked-none",
     "points.get('b')", "is not None"),
    ("odometry", "points = {'a': Point()}\npoint = points.get('b')\npoint.x, point.y",
     "unchecked-none", "point", None),
    ("odometry", "re.match('a+', self._text()).group()", "unchecked-none", None, None),
    ("odometry", "NAME.search(self._text())[0]", "unchecked-none", None, None),
    ("odometry", "self.find('a').x", "unchecked-none", "self.find('a')", None),
    ("odometry", "self.longest().upper()", "unchecked-none", "self.longest()", None),
    ("reset", "response.message = self.last.child_frame_id", "unchecked-none", "self.last", None),
    # what is iterated over, counted and caught
    ("odometry", "range(0, self.parameters.names, 2)", "invalid-value", "self.parameters.names",
     "range(len(...))"),
    ("odometry", "list(self._text)", "invalid-value", "self._text", None),
    ("odometry", "len(x for x in 'abc')", "invalid-value", None, None),
    ("odometry", "math.dist(1.0, 2.0)", "invalid-value", "1.0", None),
    ("odometry", "(1.0, 2.0)[2]", "invalid-value", "2", None),
    ("odometry", "try:\n    pass\nexcept OSError:\n    pass\nexcept TimeoutError:\n    pass",
     "unused-result", "TimeoutError", "before 'except OSError'"),
    ("odometry", "def inner(point: Point):\n    point.w", "unknown-field", "w", None),
    ("odometry", "self.publishers.text.publish(String(data=None))", "invalid-value", "None", None),
    # results
    ("odometry", "return Path()", "unused-result", "Path()", "publish"),
    ("drive", "return True", "invalid-value", "True", None),
]  # fmt: skip


@pytest.mark.parametrize(("place", "statement", "rule", "text", "hint"), MISTAKES)
def test_a_mistake_is_reported_once_where_it_is(
    place: str, statement: str, rule: str, text: str | None, hint: str | None, tmp_path: Path
) -> None:
    [diagnostic] = found(place, statement, tmp_path)
    assert diagnostic.rule.name == rule
    assert diagnostic.primary.file.path.endswith("code.py")
    assert text is None or quoted(diagnostic) == text
    assert hint is None or hint in str(diagnostic.hint)


def test_the_annotation_of_a_handler_decides_in_it(tmp_path: Path) -> None:
    system = SYSTEM.replace("nav_msgs/msg/Odometry", "geometry_msgs/msg/Point")
    code = (
        "from nav_msgs.msg import Odometry\n\n\nclass Code:\n"
        "    def on_odometry(self, message: Odometry):\n        print(message.pose)\n\n"
        "    def on_reset(self, request, response):\n        return response\n\n"
        "    def on_drive(self, goal):\n        pass\n"
    )
    (tmp_path / "robot_code.py").write_text(code, encoding="utf-8")
    [diagnostic] = diagnostics_in(system, tmp_path)
    assert diagnostic.rule.name == "handler-annotation"
    assert quoted(diagnostic) == "Odometry"
