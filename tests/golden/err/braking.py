from std_msgs.msg import Float64


class Brake:
    def on_smooth(self, message):
        self.distance = message.data

    def on_step(self):
        self.publishers.force.publish(Float64(data=self.distance))
