"""A tracker without camera and models: it plays the part that its arguments give it.

Each argument is a step: "ready", "fail:TEXT", "trouble:TEXT", "landmarks:N" (N pictures of a body,
40 ms apart), "begin" (wait until the show wants the first picture), "over", "noise", "stay".
"""

from __future__ import annotations

import json
import sys

from devices.mediapipe.joints import POSE_LANDMARKS
from devices.webcam.messages import BEGIN, FAILED, LANDMARKS, OVER, READY, TROUBLE, write_message

BODY = [[0.01 * number, -0.5 + 0.03 * number, 0.0, 0.9] for number in range(len(POSE_LANDMARKS))]


def main() -> None:
    out, show = sys.stdout.buffer, sys.stdin.buffer
    for step in sys.argv[1:]:
        name, _, text = step.partition(":")
        if name == "ready":
            write_message(out, READY)
        elif name == "fail":
            write_message(out, FAILED, text.encode())
        elif name == "trouble":
            write_message(out, TROUBLE, text.encode())
        elif name == "landmarks":
            for number in range(int(text)):
                message = {"timestamp_ms": 40 * number, "pose_world_landmarks": [BODY]}
                write_message(out, LANDMARKS, json.dumps(message).encode())
        elif name == "begin":
            assert show.read(1) == BEGIN
        elif name == "over":
            write_message(out, OVER)
        elif name == "noise":
            out.write(b"L\xff\xff\xff\xff")
            out.flush()
        else:
            show.read(1)  # until the show ends


if __name__ == "__main__":
    main()
