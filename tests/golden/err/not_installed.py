import fastkalman.filters


class Robot:
    def on_tick(self):
        fastkalman.filters.predict()
