from geometry_msgs.msg import Transform, Vector3


class Viewer:
    async def on_tick(self):
        found = await self.transforms.wait("base_link", "laser", stamp=None, timeout_ms=100)
        self.transforms.broadcast("laser", Vector3(), stamp=1.0)
        self.log.info(found.child_frame)
        found = self.transforms.lookup("base_link", found.header.frame_id, stamp=found.header.stamp)
        self.transforms.broadcast("laser", found.transform, stamp=found.header.stamp)
        self.transforms.broadcast("laser", found)
