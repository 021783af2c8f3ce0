class Brake:
    def on_smooth(self, message):
        self.distance = message.data

    def on_step(self):
        self.publishers.force.publish(self.distance)
