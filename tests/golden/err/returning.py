class Walker:
    def on_tick(self):
        pass


return Walker
