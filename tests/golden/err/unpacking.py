from composer.behavior import Behavior


class Robot(Behavior):
    def on_activate(self):
        x, y = self.parameters.goal
        first, *others = self.parameters.goal
        self.log.info(f"{x} {y} {first} {others}")

    def on_deactivate(self):
        if len(self.parameters.goal) == 2:
            x, y = self.parameters.goal
            self.log.info(f"{x} {y}")
