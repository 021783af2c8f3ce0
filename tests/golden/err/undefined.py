class Robot:
    def on_order(self, message):
        self.log.info(mesage.data)
        self.log.info(str(math.pi))
