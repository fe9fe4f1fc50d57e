"""Kinect v1, v2 and Azure through their makers' libraries: `kinect://`."""
