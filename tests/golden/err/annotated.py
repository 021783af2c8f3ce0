from std_msgs.msg import Int32


class Robot:
    def on_order(self, message: Int32):
        self.log.info(f"{message.data}")
