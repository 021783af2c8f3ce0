"""The WebSocket protocol of Foxglove, for Foxglove, Lichtblick and PlotJuggler.

The protocol is public and was published as ``foxglove.websocket.v1``. Newer programs call it
``foxglove.sdk.v1``; what is sent is the same.
"""
