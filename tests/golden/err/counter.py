class Counter:
    def on_tick(self):
        pass

    def on_tuck(self):
        pass

    def on_total(self, message):
        pass
