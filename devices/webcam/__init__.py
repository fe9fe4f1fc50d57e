"""A webcam or a film, without a model file to look for: `webcam://`."""
