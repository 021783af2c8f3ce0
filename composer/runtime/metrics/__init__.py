"""Counters and histograms of nodes and callbacks, and the messages that publish them."""
