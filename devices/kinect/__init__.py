"""Kinect v1, v2 and Azure, by their makers' libraries: `kinect://`."""
