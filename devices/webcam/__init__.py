"""A webcam or a film as a device, tracked by MediaPipe: `webcam://`."""
