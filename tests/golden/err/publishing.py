from std_msgs.msg import String


class Robot:
    def on_step(self):
        self._send(String(data="go"))

    def _send(self, text):
        self.publishers.order.publish(text)
