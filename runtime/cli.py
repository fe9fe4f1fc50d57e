"""The command line: `bunraku COMMAND --help` tells each command's options."""

from __future__ import annotations

import argparse
import importlib
import io
import math
import os
import string
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from devices.errors import InputError
from runtime.interrupt import Interrupted, interruptible

Command = Callable[[argparse.Namespace], int]

BAD_INPUT = 2


def size(text: str) -> tuple[int, int]:
    """A picture's width and height from ``WxH``."""
    width, _, height = text.lower().partition("x")
    try:
        pair = int(width), int(height)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"expected WIDTHxHEIGHT, as in 960x540, got {text!r}"
        ) from None
    if not (16 <= pair[0] <= 8192 and 16 <= pair[1] <= 8192):
        raise argparse.ArgumentTypeError(f"each side must be 16 to 8192 pixels, got {text!r}")
    return pair


def positive(text: str) -> float:
    """A finite number above 0."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a number above 0, got {text!r}") from None
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"expected a finite number above 0, got {text!r}")
    return value


def counting(text: str) -> int:
    """A whole number from 1."""
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1, got {text!r}") from None
    if not 1 <= value <= 1_000_000:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1, got {text!r}")
    return value


def whole(text: str) -> int:
    """A whole number from 0."""
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise argparse.ArgumentTypeError(f"expected a whole number from 0, got {text!r}")
    return int(text)


def share(text: str) -> float:
    """A number from 0 to 1."""
    return _between(text, 0.0, 1.0)


def stiffness(text: str) -> float:
    """A number from 0 to 0.99."""
    return _between(text, 0.0, 0.99)


def gain(text: str) -> float:
    """A number from 0 to 10."""
    return _between(text, 0.0, 10.0)


def _between(text: str, least: float, most: float) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        raise argparse.ArgumentTypeError(
            f"expected a number from {least:g} to {most:g}, got {text!r}"
        )
    return value


def colour(text: str) -> tuple[int, int, int]:
    """Red, green and blue in sRGB bytes, from ``#rrggbb``, ``#rgb`` or ``chroma``."""
    if text.lower() == "chroma":
        return 0, 255, 0
    digits = text.removeprefix("#")
    if len(digits) == 3:
        digits = "".join(2 * digit for digit in digits)
    if len(digits) != 6 or not set(digits) <= set(string.hexdigits):
        raise argparse.ArgumentTypeError(f"expected chroma or a colour as in #203040, got {text!r}")
    red, green, blue = bytes.fromhex(digits)
    return red, green, blue


def host_port(text: str) -> tuple[str, int | None]:
    """A host and a port from ``HOST:PORT``; None where there is no port."""
    host, colon, port = text.rpartition(":") if text.count(":") == 1 else (text, "", "")
    host = host.removeprefix("[").removesuffix("]")
    if not host or (colon and not (port.isdecimal() and 1 <= int(port) <= 65535)):
        raise argparse.ArgumentTypeError(f"expected HOST:PORT, as in 127.0.0.1:39539, got {text!r}")
    return host, int(port) if colon else None


def remote_address(text: str) -> tuple[str, int | None]:
    """A host and a port to be run from; ``osc://`` before them is no harm."""
    return host_port(text.removeprefix("osc://"))


def port_number(text: str) -> int:
    """A port from 1 to 65535."""
    if not (text.isascii() and text.isdecimal() and 1 <= int(text[:6]) <= 65535):
        raise argparse.ArgumentTypeError(f"expected a port from 1 to 65535, got {text!r}")
    return int(text)


class _Parser(argparse.ArgumentParser):
    """Answers bad arguments with the one line that every command answers bad input with."""

    def error(self, message: str) -> None:  # type: ignore[override]
        raise InputError(f"{message} (see `{self.prog} --help`)")


def _add_show_options(parser: argparse.ArgumentParser) -> None:
    show = parser.add_argument_group("the show")
    show.add_argument("--headless", action="store_true", help="no window")
    show.add_argument("--size", type=size, default=(960, 540), metavar="WxH", help="of the picture")
    show.add_argument(
        "--fast", action="store_true", help="as fast as it can, every frame exactly once"
    )
    show.add_argument("--speed", type=positive, default=1.0, metavar="X", help="times the recorded")
    show.add_argument("--loop", action="store_true", help="start again after the last frame")
    behind = show.add_mutually_exclusive_group()
    behind.add_argument("--transparent", action="store_true", help="no stage behind the character")
    behind.add_argument(
        "--background",
        type=colour,
        metavar="COLOUR|chroma",
        help="a plain colour such as #203040 instead of the stage; chroma is the green to key out",
    )
    show.add_argument(
        "--plain", action="store_true", help="without the matched chains and the mirror"
    )
    show.add_argument(
        "--remote",
        type=remote_address,
        metavar="HOST:PORT",
        help="let OSC run the show, as in 127.0.0.1:9100, or 0.0.0.0:9100 for a phone",
    )
    show.add_argument(
        "--remote-feedback",
        type=port_number,
        metavar="PORT",
        help="where the phone listens; the port that it sends from if absent",
    )
    _add_conditioning(parser)
    match = parser.add_argument_group("who drives what")
    match.add_argument(
        "--source",
        default="whole",
        metavar="PRESET|JOINTS",
        help="the part of the performer that drives: whole, upper, arms, legs, left-arm, "
        "right-arm, hand, ... or joint names with commas between",
    )
    match.add_argument(
        "--performers",
        type=counting,
        default=1,
        metavar="N",
        help="who comes as number K drives character K; the last of N all that are left "
        "(default 1: who comes first drives all)",
    )
    match.add_argument(
        "--match", type=counting, default=1, metavar="N", help="take the N-th best match"
    )
    match.add_argument(
        "--mapping", type=Path, metavar="FILE.json", help="joints and nodes paired by hand"
    )
    match.add_argument(
        "--chains",
        choices=("extend", "stop"),
        default="extend",
        help="drive a matched chain on to its longest leaf, or stop at the sub-tree's root",
    )
    match.add_argument("--flip", action="store_true", help="mirror the turns (flip the y-axis)")
    match.add_argument(
        "--iterations",
        type=counting,
        default=2,
        metavar="N",
        help="ARAP iterations a frame (default 2)",
    )
    made = parser.add_argument_group(
        "what characters are made of",
        "each may be repeated: the first is for the first character, the last for all that follow",
    )
    made.add_argument(
        "--cartoon",
        action="append",
        type=share,
        metavar="X",
        help="0 (default) keeps every part rigid, 1 lets it squash and stretch with its motion",
    )
    made.add_argument(
        "--volume-gain",
        action="append",
        type=gain,
        metavar="X",
        help="how much of the volume is kept when it does; more than 1 exaggerates (default 1)",
    )
    made.add_argument(
        "--stiffness",
        action="append",
        type=stiffness,
        metavar="X",
        help="0 (default) lets limbs bend all along, towards 1 they bend at their joints only",
    )
    made.add_argument(
        "--energy",
        action="append",
        choices=("spokes", "spokes-and-rims", "smooth-rotations"),
        help="what is kept as rigid as possible (default spokes)",
    )
    keep = parser.add_argument_group("what is kept")
    keep.add_argument("--video", type=Path, metavar="OUT.mp4")
    keep.add_argument(
        "--fps", type=positive, default=60.0, metavar="X", help="of video and cameras, at most"
    )
    keep.add_argument("--frames", type=Path, metavar="DIR", help="a PNG for each frame")
    keep.add_argument("--cache", type=Path, metavar="OUT.pc2", help="deformed vertices, for each")
    keep.add_argument("--report", type=Path, metavar="OUT.json", help="the show in figures")
    keep.add_argument("--record", type=Path, metavar="OUT.mcap", help="the performer's frames")
    keep.add_argument(
        "--export",
        type=Path,
        metavar="OUT.{glb,usdc,usda,bvh}",
        help="the performed character, for other programs",
    )
    keep.add_argument(
        "--virtual-camera",
        nargs="?",
        const="",
        metavar="NAME",
        help="pictures to a virtual camera, the first there is if not named",
    )
    keep.add_argument("--ndi", metavar="NAME", help="pictures over the network, by NDI")
    keep.add_argument(
        "--spout",
        metavar="NAME",
        help="pictures for programs on this machine, by Spout (Windows) or Syphon (macOS)",
    )
    keep.add_argument(
        "--vmc",
        type=host_port,
        metavar="HOST:PORT",
        help="send the performer as VMC; its receivers listen on port 39539",
    )
    keep.add_argument(
        "--publish",
        metavar="tcp://HOST:PORT",
        help="the performer for other shows, which open zmq+tcp://HOST:PORT",
    )
    keep.add_argument(
        "--publish-keys",
        type=Path,
        metavar="DIR",
        help="for --publish beyond this machine; `bunraku bridge --make-keys` makes them",
    )


CONDITIONING = {
    "order": "drop duplicates and late frames, go on where a clock jumps",
    "identities": "know performers again under a new number",
    "swaps": "put limbs right whose left and right are exchanged",
    "outliers": "leave out joints that jump and bones that stretch",
    "filter": "smooth (One-Euro); not on recordings by default",
    "predict": "show where joints will be one frame later; off by default",
    "level": "keep the floor level; not on recordings by default",
    "mirror": "as in a mirror, left is right; off by default",
    "scale": "make all performers the same size; not on recordings by default",
    "recalibrate": "a T or A pose held for a second is the rest state; off by default",
}


def _add_conditioning(parser: argparse.ArgumentParser) -> None:
    stream = parser.add_argument_group("what is done to the stream first")
    for name, text in CONDITIONING.items():
        stream.add_argument(f"--{name}", action=argparse.BooleanOptionalAction, help=text)


def _characters(parser: argparse.ArgumentParser, *, required: bool) -> None:
    parser.add_argument(
        "--character",
        action="append",
        required=required,
        metavar="C",
        help="a mesh (obj, ply, stl, off, glb, gltf, vrm) or a built-in character; may be repeated",
    )


def _command(module: str, function: str) -> Command:
    """A command that is imported when it is run, so that `--help` answers at once."""

    def run(options: argparse.Namespace) -> int:
        command: Command = getattr(importlib.import_module(f"runtime.commands.{module}"), function)
        return command(options)

    return run


def _add_bench_options(bench: argparse.ArgumentParser) -> None:
    bench.add_argument(
        "name",
        nargs="?",
        metavar="NAME",
        help="arap, table1, hold, dense, tick or match, all if absent; clips, soak, kill or "
        "latency, which take long",
    )
    bench.add_argument("--seconds", type=positive, help="of show in `bench soak` (default 3600)")
    bench.add_argument(
        "--real-time", action="store_true", help="soak at 60 Hz, not as fast as it goes"
    )
    bench.add_argument(
        "--load", action="store_true", help="latency also beside a process that loads one core"
    )
    bench.add_argument(
        "--recording",
        action="append",
        type=Path,
        metavar="FILE",
        help="for clips, instead of the built-in acts; may be repeated",
    )
    bench.add_argument(
        "--character",
        action="append",
        metavar="C",
        help="for clips, instead of the built-in characters; may be repeated",
    )
    bench.add_argument("--json", type=Path, metavar="FILE", help="write the figures there as well")


def parser() -> argparse.ArgumentParser:
    """Every command with its options."""
    top = _Parser(
        prog="bunraku",
        description="A performer moves, and any character on the screen moves with them.",
    )
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def add(name: str, run: Command, text: str) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(run=run)
        return command

    demo = add(
        "demo", _command("show", "demo"), "one performer, several characters, nothing else needed"
    )
    _characters(demo, required=False)
    _add_show_options(demo)
    demo.set_defaults(fps=30.0, size=(1280, 560))

    replay = add("replay", _command("show", "replay"), "a recorded stream drives a character")
    replay.add_argument("recording", type=Path, metavar="RECORDING")
    _characters(replay, required=True)
    _add_show_options(replay)

    live = add("live", _command("show", "live"), "a live stream drives a character")
    live.add_argument("--device", required=True, metavar="URL", help="as `bunraku devices` lists")
    _characters(live, required=True)
    _add_show_options(live)

    record = add(
        "record", _command("record", "record"), "a live stream goes to a file, without a character"
    )
    record.add_argument("--device", required=True, metavar="URL")
    record.add_argument("out", type=Path, metavar="OUT.mcap")
    record.add_argument("--seconds", type=positive, help="stop after this long")

    bridge = add(
        "bridge", _command("bridge", "bridge"), "a live stream goes to shows on other machines"
    )
    bridge.add_argument("--device", metavar="URL", help="as `bunraku devices` lists")
    bridge.add_argument(
        "--bind",
        default="tcp://127.0.0.1:5570",
        metavar="tcp://HOST:PORT",
        help="where shows find it, as zmq+tcp://HOST:PORT (default tcp://127.0.0.1:5570)",
    )
    bridge.add_argument(
        "--keys", type=Path, metavar="DIR", help="of this machine; needed beyond it"
    )
    bridge.add_argument(
        "--make-keys", type=Path, metavar="DIR", help="write keys for both machines, and end"
    )
    bridge.add_argument("--seconds", type=positive, help="stop after this long")

    there = add(
        "devices",
        _command("devices", "devices"),
        "what is connected, what arrives, which ports are taken",
    )
    there.add_argument(
        "addresses", nargs="*", metavar="URL", help="listen there (default: where each kind is)"
    )
    there.add_argument(
        "--seconds", type=positive, default=2.0, metavar="N", help="how long (default 2)"
    )
    there.add_argument("--json", type=Path, metavar="FILE", help="write it there as well")
    info = add("info", _command("info", "info"), "what is in a recording or a character's file")
    info.add_argument("file", metavar="FILE")
    convert = add(
        "convert", _command("convert", "convert"), "a recording becomes a file of another kind"
    )
    convert.add_argument("recording", type=Path, metavar="IN", help="any recording that is read")
    convert.add_argument("out", type=Path, metavar="OUT.{mcap,bvh,csv}")
    convert.add_argument("--performer", type=whole, metavar="N", help="of several, only this one")
    convert.add_argument(
        "--unit", choices=("cm", "m", "mm", "in"), help="of a BVH file (default cm)"
    )
    convert.add_argument(
        "--rate", type=positive, metavar="HZ", help="of a BVH file (default: the recording's)"
    )
    convert.add_argument("--force", action="store_true", help="replace OUT if it is there")
    figures = add(
        "figures", _command("figures", "figures"), "draw the figures on squash and stretch"
    )
    figures.add_argument("folder", type=Path, metavar="DIR", help="where the pictures go")
    figures.add_argument("--size", type=size, default=(1500, 420), metavar="WxH", help="of a row")
    _characters(figures, required=False)
    doctor = add("doctor", _command("doctor", "doctor"), "what is wrong with this machine")
    doctor.add_argument("--warm", action="store_true", help="compile the solvers ahead of time")
    _add_bench_options(add("bench", _command("bench", "bench"), "how fast it is here"))
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit code is 0, 2 for bad input, 130 after Ctrl-C."""
    for stream in (sys.stdout, sys.stderr):  # a name may hold what the terminal cannot show
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        with interruptible():
            options = parser().parse_args(arguments)
            run: Command = options.run
            code = run(options)
            print(end="", flush=True)
            return code
    except InputError as error:
        return _refuse(str(error))
    except Interrupted as interrupted:
        return interrupted.code
    except BrokenPipeError:  # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _refuse(f"{where}{error.strerror or error}; check the file and its disk")
    except MemoryError:
        return _refuse("this needs more memory than there is; use a smaller file, or close others")


def _refuse(reason: str) -> int:
    print(f"bunraku: error: {' '.join(reason.split())}", file=sys.stderr)
    return BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
