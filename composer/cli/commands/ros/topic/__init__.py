"""``compose topic``: the topics of the ROS graph."""

from __future__ import annotations

import typer

from composer.cli.commands.ros.topic.echo import echo
from composer.cli.commands.ros.topic.info import info
from composer.cli.commands.ros.topic.lists import find, list_topics, type_of
from composer.cli.commands.ros.topic.pub import pub
from composer.cli.commands.ros.topic.rates import bw, delay, hz
from composer.cli.support.options import examples

app = typer.Typer(
    help="List, inspect, measure and publish topics.",
    epilog=examples(
        "compose topic list -t",
        "compose topic echo /sensor_data --once",
        "compose topic hz /sensor_data",
        "compose topic pub --once /chatter std_msgs/msg/String '{data: hello}'",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)


app.command("list", epilog=examples("compose topic list", "compose topic list --show-types"))(
    list_topics
)
app.command("type", epilog=examples("compose topic type /sensor_data"))(type_of)
app.command("find", epilog=examples("compose topic find std_msgs/msg/String"))(find)
app.command("info", epilog=examples("compose topic info -v /sensor_data"))(info)
app.command(
    "echo",
    epilog=examples(
        "compose topic echo /sensor_data",
        "compose topic echo /sensor_data --once",
        "compose topic echo /sensor_data --field pose.pose.position --count 3",
        "compose topic echo /sensor_data --filter 'message.twist.twist.linear.x > 0.1'",
        "compose topic echo /chatter --json | jq .data",
    ),
)(echo)
app.command("hz", epilog=examples("compose topic hz /sensor_data --window 100"))(hz)
app.command("delay", epilog=examples("compose topic delay /sensor_data --window 100"))(delay)
app.command("bw", epilog=examples("compose topic bw /camera/image"))(bw)
app.command(
    "pub",
    epilog=examples(
        "compose topic pub /chatter std_msgs/msg/String '{data: hello}'",
        "compose topic pub --once /goal geometry_msgs/msg/Point '{x: 1.0, y: 2.0}'",
        "compose topic pub -r 10 /chatter std_msgs/msg/String '{data: \"number {count}\"}'",
    ),
)(pub)
