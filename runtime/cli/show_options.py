"""The options of a show: of `bunraku demo`, `replay` and `live`."""

from __future__ import annotations

import argparse
from pathlib import Path

from runtime.cli.arguments import (
    colour,
    counting,
    gain,
    host_port,
    port_number,
    positive,
    remote_address,
    share,
    size,
    stiffness,
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


def add_show_options(parser: argparse.ArgumentParser) -> None:
    """Add every option of a show."""
    _add_stage(parser)
    _add_remote(parser)
    _add_conditioning(parser)
    _add_match(parser)
    _add_matter(parser)
    _add_files(parser)
    _add_other_programs(parser)


def _add_stage(parser: argparse.ArgumentParser) -> None:
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


def _add_remote(parser: argparse.ArgumentParser) -> None:
    show = parser.add_argument_group("who runs it from afar")
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


def _add_conditioning(parser: argparse.ArgumentParser) -> None:
    stream = parser.add_argument_group("what is done to the stream first")
    for name, text in CONDITIONING.items():
        stream.add_argument(f"--{name}", action=argparse.BooleanOptionalAction, help=text)


def _add_match(parser: argparse.ArgumentParser) -> None:
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
        help="ARAP iterations a frame, the last of several after it is shown (default 2)",
    )


def _add_matter(parser: argparse.ArgumentParser) -> None:
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


def _add_files(parser: argparse.ArgumentParser) -> None:
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


def _add_other_programs(parser: argparse.ArgumentParser) -> None:
    send = parser.add_argument_group("what other programs are given")
    send.add_argument(
        "--virtual-camera",
        nargs="?",
        const="",
        metavar="NAME",
        help="pictures to a virtual camera, the first there is if not named",
    )
    send.add_argument("--ndi", metavar="NAME", help="pictures over the network, by NDI")
    send.add_argument(
        "--spout",
        metavar="NAME",
        help="pictures for programs on this machine, by Spout (Windows) or Syphon (macOS)",
    )
    send.add_argument(
        "--vmc",
        type=host_port,
        metavar="HOST:PORT",
        help="send the lead performer as VMC; its receivers listen on port 39539",
    )
    send.add_argument(
        "--publish",
        metavar="tcp://HOST:PORT",
        help="the performers for other shows, which open zmq+tcp://HOST:PORT",
    )
    send.add_argument(
        "--publish-keys",
        type=Path,
        metavar="DIR",
        help="for --publish beyond this machine; `bunraku bridge --make-keys` makes them",
    )
