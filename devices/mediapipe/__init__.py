"""MediaPipe landmarks, from a webcam or another program: `mediapipe://`."""
