from std_srvs.srv import Trigger


class Robot:
    async def on_tick(self):
        self.clock.sleep(0.01)
        response = self.clients.reset.call(Trigger.Request())
        self.log.info(response.message)

    def on_tock(self):
        self._text()

    async def _text(self):
        return "text"
