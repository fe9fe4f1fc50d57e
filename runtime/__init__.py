"""The frame loop and what it drives: characters, session, window, outputs, command line."""
