"""Recordings of the Leap Motion's messages."""
