"""Python code of behaviors that is right."""

from __future__ import annotations

from pathlib import Path

from tests.unit.support.behavior_code import SYSTEM, code_with
from tests.unit.support.python_cases import diagnostics_of

#: The place of a statement, and the statement.
RIGHT = [
    ("odometry", "self.publishers.text.publish(String(data=self._text()))"),
    ("odometry", "self.publishers['text'].publish(String())"),
    ("function", "stamp = str(stamp).split()\nlen(stamp)"),
    ("function", "def stamp():\n    return 1\nstamp()"),
    ("odometry", "self.parameters['wheel.radius']"),
    ("odometry", "self.publishers.path.publish(Path(header=message.header))"),
    ("odometry", "String.get_fields_and_field_types()"),
    ("odometry", "BatteryState.POWER_SUPPLY_STATUS_FULL"),
    ("odometry", "BatteryState().POWER_SUPPLY_STATUS_FULL"),
    ("odometry", "Point(x=1.0, y=-1.5)"),
    ("odometry", "point = Point()\npoint.x, point.y = 1.0, 2.0"),
    ("odometry", "Time(sec=True)"),
    ("odometry", "self.rates = {}\nself.rates['a'] = 1\nself.rates.keys().isdisjoint('b')"),
    ("odometry", "total = 0\nfor _ in range(3):\n    total += 0.5\nPoint(x=total)"),
    ("odometry", "Path(poses=[PoseStamped()] * 2)"),
    ("odometry", "self.scale(2)\nself.scale(factor=2.5, name='a')\nself.scale(*[1], **{})"),
    ("odometry", "now = self.clock.stamp()\nnow.sec + now.nanosec * 1e-9"),
    ("odometry", "names = sorted(self.parameters.names)\nnames.append('b')\nnames[0].upper()"),
    ("odometry", "'%s and %d' % (self.count, 5)\n'a' * 3\n[0] * 3"),
    ("odometry", "Mode.FAST.name, Mode['FAST'].value, Mode.parse('a')"),
    ("odometry", "Statistics().scores.append(1.0)\nself.statistics.mean() * 2"),
    ("odometry", "total = 1\ntotal += 1"),
    (
        "odometry",
        "def fail() -> int:\n"
        "    if message:\n"
        "        return 1\n"
        "    raise_error()\n"
        "def raise_error():\n"
        "    raise ValueError\n"
        "fail()",
    ),
    ("odometry", "self.others = self.wheel1 = 1\nself.wheel2 = self.wheel1"),
    ("odometry", "Reference(1, limit=2), Reference(*[1, 2])"),
    ("odometry", "if self.parameters.mode == 'slow' or self.parameters.mode != 'fast':\n    pass"),
    ("odometry", "self.statistics.extra = 1\nself.statistics.extra"),
    ("odometry", "Point(x=self.parameters.speed, y=float('1'))"),
    ("odometry", "message.__class__.__name__"),
    ("odometry", "from collections import OrderedDict\nOrderedDict(a=1).popitem(False)"),
    ("odometry", "message.child_frame_id.upper()"),
    ("odometry", "Path().poses.append(PoseStamped())"),
    ("odometry", "items = [message]\nfor message in items:\n    message.anything"),
    ("odometry", "(lambda message: message.anything)(5)"),
    ("odometry", "def inner(message):\n    return message.anything\ninner(5)"),
    ("odometry", "setattr(self, 'later', 1)\nself.later"),
    ("odometry", "self.LIMIT, self.name, self.__dict__, self.__class__"),
    ("odometry", "self.extra = 1\nself.extra += 1"),
    ("odometry", "setattr(self, 'never', 0)\nself.never += 1"),
    ("odometry", "if len(self.parameters.names) > 1:\n    self.parameters.names[1]"),
    ("odometry", "try:\n    self.parameters.names[1]\nexcept IndexError:\n    pass"),
    ("odometry", "first, *others = self.parameters.names\nself.parameters.names[-1], others"),
    ("odometry", "message.pose.covariance = [0.0] * 36"),
    ("odometry", "message.pose.covariance = [*range(36)]"),
    ("odometry", "math.log(1.0, 2), math.hypot(), math.isclose(1, 1, rel_tol=0.1), math.pi"),
    ("odometry", "self.count < self.parameters.speed, 'a' < self.parameters.mode"),
    ("odometry", "def inner():\n    return ValueError('no')"),
    ("odometry", "asyncio.run(self._wait())"),
    ("odometry", "threading.Thread(target=self._text).start()"),
    ("odometry", "try:\n    import tyme\nexcept ImportError:\n    tyme = None"),
    ("odometry", "from std_srvs.srv import Trigger_Request"),
    ("odometry", "import os.path\nos.path.join('a')"),
    ("odometry", "import concurrent.futures\nconcurrent.futures.Future"),
    ("odometry", "[x for x in range(3) if (y := x)]\ny"),
    ("odometry", "try:\n    pass\nexcept CallError as error:\n    self.log.warn(str(error))"),
    ("odometry", "global later\nlater = 1"),
    ("configure", "task = self._wait()\nawait task"),
    ("configure", "asyncio.run(asyncio.sleep(0.1))\nawait asyncio.sleep(0.1)"),
    ("configure", "self.keep(self._wait(), wait(Time()))"),
    ("configure", "tasks = [self._wait()]\nself.keep(tasks)"),
    ("configure", "self.task = self._wait()\nif self.task is not None:\n    await self.task"),
    ("configure", "while True:\n    await self.clock.sleep(1.0)"),
    ("configure", "while True:\n    if self.count:\n        break"),
    ("configure", "while self.count < 5:\n    self.count += 1"),
    ("drive", "goal.request.target.x\ngoal.succeed()\nreturn Navigate.Result()"),
    ("drive", "while not goal.is_cancel_requested:\n    await self.clock.sleep(0.1)"),
    ("reset", "response.success = True"),
    ("reset", "while True:\n    return response"),
    ("reset", "return Trigger.Response(success=True)"),
    ("reset", "def small():\n    return True\nresponse.success = small()"),
    ("reset", "raise ValueError(request)"),
    ("follow", "goal.request.target\nself.later = sent.cancel"),
    ("odometry", "for i, (x, y) in enumerate([(1.0, 2.0)]):\n    Point(x=x)\n    Time(sec=i)"),
    ("odometry", "*others, last = (1, 'a')\nString(data=last)"),
    ("odometry", "self.values = {}\nfor key, value in self.values.items():\n    key.anything"),
    ("odometry", "for a in 'xyz':\n    getattr(message.pose.pose.position, a)"),
    ("odometry", "DiagnosticStatus(level=b'\\x02')\nDiagnosticStatus().level.hex()"),
    ("odometry", "DiagnosticStatus(level=bytes([self.count]))"),
    ("odometry", "DiagnosticStatus().level = DiagnosticStatus.WARN if message else b'a'"),
    ("odometry", "self.later = False\nself.later = message\nself.later.pose"),
    ("odometry", "self.later: float | list[float] = 0.0\nself.later = [1.0]"),
    ("odometry", "self.last = Point()"),
    ("odometry", "try:\n    pass\nexcept OSError as error:\n    error.errno, error.strerror"),
    ("odometry", "message.pose.covariance[-36], message.pose.covariance.tolist()"),
    ("odometry", "'{} {}'.format(*[1, 2]), '{a}'.format(**{'a': 1}), '{} {{}}'.format(1, 2)"),
    ("odometry", "'{0.x:>{1}} {name!r:>9}'.format(Point(), 5, name=None)"),
    ("odometry", "'%d%% of %.1f' % (self.count, True), '%s %r' % (None, message)"),
    ("odometry", "Statistics(1), Statistics(scores=[1.0]), Statistics()"),
    ("odometry", "Path(poses=(PoseStamped(),)), Path(poses=[*Path().poses])"),
    ("odometry", "String(data=', '.join(name for name in self.parameters.names))"),
    ("odometry", "String(data=min('a', 'b'))\nmin(self.parameters.names, key=len).upper()"),
    ("odometry", "[0.5] * self.count, self.count * 'a', (1, 2) + (3,)"),
    ("odometry", "names: dict[str, float] = {}\nnames['a'] = 1\nnames.setdefault('b', 2.0)"),
    ("odometry", "self.first([]), Code.first([], 'a')"),
    ("odometry", "Point(x=float(self.statistics.mean()))"),
    ("odometry", "sorted(self.parameters.names, key=len, reverse=True)[0].upper()"),
    ("odometry", "next(iter(self.parameters.names), '').upper()"),
    ("function", "stamp.sec\nstamp.nanosec"),
    ("odometry", "range(len(self.parameters.names), 0, -1)\nlen(list(x for x in 'abc'))"),
    ("odometry", "(1.0, 2.0)[-2]\n(1.0, *self.parameters.names)[5]"),
    ("odometry", "try:\n    pass\nexcept TimeoutError:\n    pass\nexcept OSError:\n    pass"),
    ("odometry", "points = {'a': Point()}\nif point := points.get('b'):\n    point.x"),
    ("odometry", "point = {'a': Point()}.get('b')\nassert point is not None\npoint.x"),
    ("odometry", "points = {'a': Point()}\nif 'b' in points:\n    points.get('b').x"),
    ("odometry", "points = {'a': Point()}\nif points.get('b'):\n    points.get('b').x"),
    ("odometry", "point = self.find('a')\nprint(point.x if point else 0)"),
    ("odometry", "self.last.child_frame_id"),
    ("odometry", "point = message\ndef inner(point: Point):\n    point.x\npoint.pose"),
    ("odometry", "def one(it: Point):\n    it.x\ndef two(it):\n    it.pose"),
    ("odometry", "a, b, *c = 1, 2\n(a, b), c = (1, 2), 3"),
    ("odometry", "True * [1], [0] * self.count, '%d' % 1, 'a' * True, {1} - {2}, {1: 2} | {3: 4}"),
    (
        "odometry",
        "self.phase = self.phase + 0.1 if hasattr(self, 'phase') else 0.0\nself.phase.real",
    ),
    (
        "odometry",
        "try:\n    self.phase = self.phase + 1\nexcept AttributeError:\n    self.phase = 0",
    ),
    ("odometry", "try:\n    pass\nexcept (ValueError, (KeyError, OSError)):\n    pass"),
    ("odometry", "self.apply(lambda value: value), self.apply(abs), self.apply(self.find)"),
    ("odometry", "self.apply(lambda *values: 1.0), self.apply(lambda value, digits=2: value)"),
    ("odometry", "a, b = 'ab'"),
    ("odometry", "found = self.ends('a')\nif found is not None:\n    a, b = found"),
    ("odometry", "place = Point()\nplace = self.use(place)\nplace + 1.0"),
    (
        "odometry",
        "text = self.parameters.names\ntext = text[0] if isinstance(text, list) else text.upper()",
    ),
    ("odometry", "near = self.find('a')\nif near:\n    self.use(near)"),
    ("odometry", "p = Point()\n[p.upper() for p in self.parameters.names]\np.x"),
    ("odometry", "p = Point()\n[lambda p: p.upper() for p in Path().poses]\np.x"),
    ("odometry", "[p.x for p in [q.pose.position for q in Path().poses]], [p for p in 'ab']"),
    ("odometry", "(lambda p: p.upper())('a'), [p.pose for p in Path().poses]"),
    ("odometry", "max(self.parameters.names, key=lambda p: p.upper())\np = Point()\np.x"),
    ("odometry", "errors = ValueError, KeyError\ntry:\n    pass\nexcept errors:\n    pass"),
]


def test_right_code_is_not_reported(tmp_path: Path) -> None:
    codes = [code_with(place, statement) for place, statement in RIGHT]
    results = diagnostics_of(SYSTEM, codes, tmp_path)
    reported = [
        (case, [x.message for x in found]) for case, found in zip(RIGHT, results, strict=True)
    ]
    assert [item for item in reported if item[1]] == []


def test_a_comment_in_python_ignores_a_warning(tmp_path: Path) -> None:
    code = code_with("drive", "time.sleep(1.0)  # compose: ignore[blocking-call]")
    assert diagnostics_of(SYSTEM, [code], tmp_path) == [[]]
