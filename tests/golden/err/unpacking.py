from composer.behavior import Behavior


class Robot(Behavior):
    def on_activate(self):
        x, y = self.parameters.goal
        first, *others = self.parameters.goal
        self.log.info(f"{x} {y} {first} {others} {self.parameters.goal[1]}")
