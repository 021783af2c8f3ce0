"""A misspelled import hides the name it should bind, and no other."""

from std_msgs.msg import Strin

from composer.behavior import Behavior


class Talker(Behavior):
    def on_tick(self):
        message = String()
        message.data = greeting
        self.publishers.words.publish(message)
