class Robot:
    def on_reset(self, request, response):
        if response.success:
            return
        return response

    def on_stop(self, request, response):
        try:
            response.success = True
            return response
        except ValueError:
            response.success = False

    def accept_count(self, request):
        request.max_velocity > 0.0

    async def on_count(self, goal):
        pass
