from geometry_msgs.msg import Point, Twist, Vector3
from nav_msgs.msg import Path
from std_msgs.msg import String
from std_srvs.srv import Trigger


class Robot:
    def on_activate(self):
        self.odometry = None

    def on_odometry(self, message):
        self.odometry = message
        self.log.info(message.pose.pose.positon)

    async def on_tick(self):
        self.log.info(self.odometry.header.frame)
        command = Twist(linear=Vector3(x=1.0), angle=Vector3())
        command.angular.w = 1.0
        command.linear = Point()
        self.publishers.command.publish(command)
        self.publishers.command.publish(String(data=5))
        response = await self.clients.reset.call(Trigger.Reqest())
        self.log.info(f"{response.sucess} {_first(Path())}")


def _first(path: Path):
    return [pose.header.stamp.secs for pose in path.poses]
