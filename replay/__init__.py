"""Recorded streams behind the same interface as live ones: readers, the recorder, the player."""
