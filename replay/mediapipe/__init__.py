"""Read recorded MediaPipe landmarks."""
