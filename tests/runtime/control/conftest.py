"""Fixtures of the controls: a display for windows, also on a machine without a screen."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator

import glfw
import pytest


@pytest.fixture(scope="session")
def display() -> Iterator[None]:
    """A display that windows open on: the one that is there, or else an Xvfb of our own."""
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        yield
        return
    program = shutil.which("Xvfb")
    if program is None:
        pytest.skip("needs a display, or Xvfb to make one")
    read, write = os.pipe()
    server = subprocess.Popen(
        [program, "-displayfd", str(write), "-screen", "0", "1280x720x24", "-nolisten", "tcp"],
        pass_fds=[write],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    with os.fdopen(read) as told, pytest.MonkeyPatch.context() as environment:
        number = told.readline().strip()  # written once it answers; empty if it ended
        if number:
            environment.setenv("DISPLAY", f":{number}")
            yield
            glfw.terminate()  # Xlib ends the process if the server goes first
    server.terminate()
    server.wait()
    if not number:
        pytest.skip("needs a display, and Xvfb makes none here")
