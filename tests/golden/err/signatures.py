class Counter:
    def on_tick(self, timer):
        pass

    def on_beat(self):
        pass

    def on_reset(self, request, response, *, urgent=False):
        return response

    def on_activate(self, state):
        pass

    def on_error(self):
        pass
