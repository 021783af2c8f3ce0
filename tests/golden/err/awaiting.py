class Counter:
    def on_tick(self):
        größe = 1
        await self.clock.sleep(größe)
