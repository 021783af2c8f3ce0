import maths
import os.pth
from math import sqroot

import time
from composer.behavior import Behavier
from composer.behaviors import Behavior
from geometry_msgs.msg import Pont
from geometry_msgs.msgs import Point
from std_mgs.msg import String

try:
    import fastmath
except ImportError:
    fastmath = None


class Robot:
    def on_tick(self):
        self.log.info(f"{time.monotonc()} {fastmath}")
