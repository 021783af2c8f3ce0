from std_msgs.msg import String


class Robot:
    def on_activate(self):
        self.count = 0

    def on_tick(self):
        self.publishers.comand.publish(String())
        self.publishers.command.publsh(String())
        self.publishers.reset.publish(String())
        self.log.info(str(self.parameters.sped))
        self.cuont += 1
        self.log.warning("done")
        self.timers.tick.cancel()
        self.start_s = self.clock.now_s()
