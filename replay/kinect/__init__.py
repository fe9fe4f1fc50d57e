"""Readers of recorded Kinect bodies in the text formats of public data sets."""
