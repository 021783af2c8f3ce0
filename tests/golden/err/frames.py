from std_msgs.msg import Header


class Camera:
    def on_tick(self):
        header = Header(frame_id="/camera")
        header.frame_id = "/map"
        header.frame_id = self.parameters.lens
        self.publishers.header.publish(header)
