"""The commands that work on sessions."""
