from geometry_msgs.msg import Vector3
from std_srvs.srv import Trigger


class Robot:
    def on_tick(self):
        self.publishers.command.publish(Vector3())

    async def on_tock(self):
        await self.clients.reset.call(Trigger.Response())
