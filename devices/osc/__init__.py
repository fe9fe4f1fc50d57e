"""Devices that send Open Sound Control: VMC, VRChat trackers, NI mate and similar programs."""
