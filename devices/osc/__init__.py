"""Performers that arrive as OSC: VMC, VRChat trackers, NI mate and similar programs."""
