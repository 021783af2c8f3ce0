class Robot:
    def on_tick():
        pass

    def on_order(message):
        print(message.data)

    def _log(text):
        self.log.info(text)

    @staticmethod
    def _plain(text):
        return text
