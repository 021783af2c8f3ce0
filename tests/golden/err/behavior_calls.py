import asyncio

from geometry_msgs.msg import Point


class Counter:
    count = 0

    async def on_tick(self):
        self.report()
        self.publishers.point.publish()
        self.count = self.count + "1"
        self.publishers.point.publish(Point(x=1))
        await asyncio.sleep(0.1)

    def report(self, text: str) -> str:
        if text:
            return text
