import subprocess
from time import sleep as pause


class Sleeper:
    async def on_beat(self, message):
        await self.clock.sleep(1.0)
        self._ask()

    def on_tick(self):
        pause(0.5)
        self._ask()

    def _ask(self):
        subprocess.run(["true"], check=True)

    def never_called_by_a_handler(self):
        pause(60.0)
