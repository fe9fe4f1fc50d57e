"""Recorded MediaPipe landmarks."""
