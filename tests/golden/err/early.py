from std_msgs.msg import Bool


class Robot:
    def __init__(self):
        self.log.info(self.name)

    def on_configure(self):
        self.publishers.ready.publish(Bool(data=False))

    def on_tick(self):
        self.publishers.ready.publish(Bool(data=True))
