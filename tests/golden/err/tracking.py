from geometry_msgs.msg import Transform, Vector3


class Tracker:
    def on_tick(self):
        self.transforms.lookup(self.parameters.frame, "laser")
        found = self.transforms.lookup("camera", "laser", stamp=self.clock.stamp())
        found.transform.translation.w = 1.0
        self.transforms.wait("camera", "mark")
        self.transforms.lookup("camera", "mark", time=1)
        self.transforms.look("camera", "mark")
        self.transforms.broadcast("persn", Transform())
        self.transforms.broadcast("fixed", Transform())
        self.transforms.broadcast("same", Transform())
        self.transforms.broadcast("mark", Vector3())
        self.transforms.broadcast("/person", Transform(), stamp=None)


class Silent:
    def on_tick(self):
        if self.transforms.can_lookup("camera", "mark"):
            self.log.info("found")
