"""Recorded Kinect bodies in the text formats of public data sets."""
