"""MediaPipe landmarks from another program: `mediapipe://`."""
