"""Leap Motion hands, by LeapC or by WebSocket: `leap://` and `leap+ws://`."""
