"""Record and replay: bags in MCAP, as rosbag2 writes them, and what is done with them."""
