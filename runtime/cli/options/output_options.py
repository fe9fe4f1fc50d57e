"""The options of a show's outputs: files to write and programs to send to."""

from __future__ import annotations

import argparse
from pathlib import Path

from runtime.cli.options.arguments import Once, host_port, positive, share_or_rigid
from runtime.show.settings import FileSettings, SenderSettings


def file_settings(options: argparse.Namespace) -> FileSettings:
    """The files that the options of a command line ask for."""
    return FileSettings(
        video=options.video,
        frames=options.frames,
        cache=options.cache,
        report=options.report,
        record=options.record,
        export=options.export,
        export_within=options.export_within,
    )


def sender_settings(options: argparse.Namespace) -> SenderSettings:
    """The programs that the options of a command line ask to send to."""
    return SenderSettings(
        virtual_camera=options.virtual_camera,
        ndi=options.ndi,
        spout=options.spout,
        vmc=options.vmc,
        publish=options.publish,
        publish_keys=options.publish_keys,
    )


def add_file_options(
    parser: argparse.ArgumentParser, *, export_within: float | None = None
) -> None:
    """Add the options that write files.

    Args:
        parser: of the command.
        export_within: default of the option with this name.
    """
    keep = parser.add_argument_group("files to write")
    keep.add_argument(
        "--video",
        action=Once,
        type=Path,
        metavar="OUT.mp4",
        help="the pictures as a video: mp4, m4v, mov, mkv or webm",
    )
    keep.add_argument(
        "--fps",
        type=positive,
        default=60.0,
        metavar="X",
        help="pictures per second of videos and cameras, at most (default 60; demo 30)",
    )
    keep.add_argument("--frames", action=Once, type=Path, metavar="DIR", help="a PNG of each frame")
    keep.add_argument(
        "--cache",
        action=Once,
        type=Path,
        metavar="OUT.pc2",
        help="the deformed vertices of each frame",
    )
    keep.add_argument(
        "--report",
        action=Once,
        type=Path,
        metavar="OUT.json",
        help="match, times and quality in figures",
    )
    keep.add_argument(
        "--record",
        action=Once,
        type=Path,
        metavar="OUT.mcap",
        help="the performer's frames as they arrived",
    )
    keep.add_argument(
        "--export",
        action=Once,
        type=Path,
        metavar="OUT.{glb,usdc,usda,bvh}",
        help="the performed character, for other programs",
    )
    keep.add_argument(
        "--export-within",
        type=share_or_rigid,
        default=export_within,
        metavar="SHARE",
        help="how far the surface of a .glb or a joint of a .bvh may be from where it was "
        "performed, as a share of the height, such as 1e-4: morph targets correct the skin, and "
        "joints slide; or `rigid`: a skin alone, and rigid bones "
        f"(default: {'rigid' if export_within is None else export_within})",
    )


def add_sender_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that send to other programs."""
    send = parser.add_argument_group("sending to other programs")
    send.add_argument(
        "--virtual-camera",
        nargs="?",
        const="",
        metavar="NAME",
        help="send the pictures to this virtual camera, or to the first one if NAME is missing",
    )
    send.add_argument(
        "--ndi", metavar="NAME", help="send the pictures over the network under this NDI name"
    )
    send.add_argument(
        "--spout",
        metavar="NAME",
        help="share the pictures with programs on this machine by Spout (Windows) or Syphon "
        "(macOS)",
    )
    send.add_argument(
        "--vmc",
        type=host_port,
        metavar="HOST:PORT",
        help="send the first performer as VMC (default port 39539)",
    )
    send.add_argument(
        "--publish",
        metavar="tcp://HOST:PORT",
        help="publish the performers for other shows, which open zmq+tcp://HOST:PORT",
    )
    send.add_argument(
        "--publish-keys",
        type=Path,
        metavar="DIR",
        help="keys for --publish to other machines; `bunraku bridge --make-keys DIR` makes them",
    )
