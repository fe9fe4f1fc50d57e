"""The checks of `bunraku doctor`."""

from __future__ import annotations

import importlib
import os
import platform
import socket
import sys
from collections.abc import Callable
from pathlib import Path

from devices.address import LOOPBACK
from devices.errors import InputError
from devices.transport.port_owner import port_owner
from devices.transport.udp import QUEUE
from runtime.cli.device_watch import listening_ports
from runtime.output.files.video import encoder_for
from runtime.render.context import headless_context, is_software, release_headless, renderer_name
from runtime.render.egl import egl_devices
from solvers.kernels.cache import cache_folder

EXTRAS: dict[str, tuple[str, ...]] = {
    "characters": ("pygel3d", "fast_simplification", "manifold3d"),
    "video": ("av",),
    "usd": ("pxr",),
    "leap": ("websockets",),
    "timeline": ("opentimelineio",),
    "microphone": ("sounddevice",),
    "webcam": ("mediapipe", "cv2"),
    "camera": ("pyvirtualcam",),
    "ndi": ("cyndilib",),
    "bench": ("igl",),
}
if sys.platform in ("win32", "darwin"):
    EXTRAS["spout"] = ("SpoutGL",) if sys.platform == "win32" else ("syphon",)
LONGEST_QUEUE = Path("/proc/sys/net/core/rmem_max")  # [bytes] the most that Linux gives a socket

Check = Callable[[], str]


def check_all() -> int:
    """Print a line for each thing that a show needs; return how many are wrong."""
    wrong = 0
    for name, check in CHECKS.items():
        try:
            print(f"ok       {name:<12} {check()}")
        except (InputError, OSError) as error:
            wrong += 1
            print(f"WRONG    {name:<12} {error}")
    for name, note in NOTES.items():
        print(note(name))
    for extra, modules in EXTRAS.items():
        print(_extra(extra, modules))
    return wrong


def _python() -> str:
    if not (3, 11) <= sys.version_info[:2] <= (3, 13):
        raise InputError(f"Python {platform.python_version()}: install Python 3.11, 3.12 or 3.13")
    return f"{platform.python_version()} on {platform.system()} {platform.machine()}"


def _egl() -> str:
    if not sys.platform.startswith("linux"):
        return "not needed here"
    devices = egl_devices()
    if not devices:
        raise InputError("EGL has no device; install a graphics driver or libgl1-mesa-dri")
    names = [f"{one.vendor} {one.version}" if one.vendor else "no access" for one in devices]
    return f"{len(devices)} device{'s' * (len(devices) != 1)}: {', '.join(names)}"


def _headless() -> str:
    context = headless_context()
    try:
        kind = "software" if is_software(context) else "hardware"
        vendor = context.info.get("GL_VENDOR", "unknown vendor")
        return f"{vendor}, {renderer_name(context)} ({kind})"
    finally:
        release_headless(context)


def _display() -> str:
    if not sys.platform.startswith("linux"):
        return "native"
    shown = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    return shown or "none: run shows with --headless"


def _cache() -> str:
    folder: Path = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK):
        raise InputError(f"{folder} cannot be written: every start extracts skeletons again")
    return str(folder)


def _video() -> str:
    return encoder_for(Path("out.mp4"))


CHECKS: dict[str, Check] = {
    "python": _python,
    "EGL": _egl,
    "headless GL": _headless,
    "display": _display,
    "cache": _cache,
    "video": _video,
}


def _ports(name: str) -> str:
    """The UDP ports of devices that other programs have, such as another show: no fault."""
    taken = [port for port in listening_ports() if not _is_free(port)]
    if not taken:
        return f"ok       {name:<12} {', '.join(map(str, listening_ports()))} are free"
    owners = []
    for port in taken:
        owner = port_owner(port)
        owners.append(
            f"{port} by {f'{owner.name} (process {owner.process})' if owner else 'others'}"
        )
    return f"taken    {name:<12} {', '.join(owners)}: close it, or give the device another port"


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as trial:
        try:
            trial.bind((LOOPBACK, port))
        except OSError:
            return False
        return True


def udp_queue(name: str, limit: Path = LONGEST_QUEUE) -> str:
    """The most bytes of datagrams that wait while the program is busy."""
    try:
        longest = int(limit.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return f"ok       {name:<12} as the system sets it"
    if longest < QUEUE:
        cure = f"sudo sysctl -w net.core.rmem_max={QUEUE}"
        return f"small    {name:<12} {longest} bytes; bursts may lose packets: {cure}"
    return f"ok       {name:<12} {longest} bytes"


Note = Callable[[str], str]
NOTES: dict[str, Note] = {"UDP ports": _ports, "UDP queue": udp_queue}
"""Notes: they do not count as wrong."""


def _extra(extra: str, modules: tuple[str, ...]) -> str:
    missing = []
    for module in modules:
        try:
            importlib.import_module(module)
        except (ImportError, OSError):  # OSError: a system library that the module needs
            missing.append(module)
    if missing:
        hint = f"pip install 'bunraku[{extra}]'"
        return f"missing  {extra:<12} {', '.join(missing)}: {hint}"
    return f"ok       {extra:<12} {', '.join(modules)}"
