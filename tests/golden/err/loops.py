class Robot:
    async def on_tick(self):
        while True:
            self.count = 1

    def on_count(self, goal):
        while not goal.is_cancel_requested:
            self.count = 2

    def in_a_thread_perhaps(self):
        while True:
            self.count = 3
