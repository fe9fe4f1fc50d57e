"""Recordings: readers of many file formats, the recorder, and playback as a live-like stream."""
