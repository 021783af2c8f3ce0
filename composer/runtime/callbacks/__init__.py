"""How a callback runs: its context, queue, timing, budget and reactions."""
