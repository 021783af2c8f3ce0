from composer.runtime.host import Host


class Robot:
    def on_tick(self):
        self.log.info(str(Host))
