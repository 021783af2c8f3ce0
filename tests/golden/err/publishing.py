class Robot:
    def on_step(self):
        self._send("go")

    def _send(self, text):
        self.publishers.order.publish(text)
