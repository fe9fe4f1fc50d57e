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
) -> argparse._ArgumentGroup:
    """Add the options that write files of what is performed; return their group.

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
        help="write a video: mp4, m4v, mov, mkv or webm",
    )
    keep.add_argument(
        "--fps",
        type=positive,
        default=60.0,
        metavar="X",
        help="the most pictures per second of videos and cameras (default: %(default)g)",
    )
    keep.add_argument(
        "--frames",
        action=Once,
        type=Path,
        metavar="DIR",
        help="write a PNG of each frame to this folder",
    )
    keep.add_argument(
        "--cache",
        action=Once,
        type=Path,
        metavar="OUT.pc2",
        help="write the deformed vertices of each frame",
    )
    keep.add_argument(
        "--report",
        action=Once,
        type=Path,
        metavar="OUT.json",
        help="write figures of the match, the times and the quality",
    )
    keep.add_argument(
        "--export",
        action=Once,
        type=Path,
        metavar="OUT.{glb,usdc,usda,bvh}",
        help="write the performed character for other programs",
    )
    keep.add_argument(
        "--export-within",
        type=share_or_rigid,
        default=export_within,
        metavar="SHARE",
        help="the farthest that the surface of a .glb or a joint of a .bvh may be from where it "
        "was performed, as a share of the height: morph targets correct the skin, and joints "
        "slide; rigid: only a skin and rigid bones "
        f"(default: {'rigid' if export_within is None else export_within})",
    )
    return keep


def add_record_option(group: argparse._ArgumentGroup) -> None:
    """Add the option that records a performer, for commands that have one."""
    group.add_argument(
        "--record",
        action=Once,
        type=Path,
        metavar="OUT.mcap",
        help="write the performer's frames as they arrived",
    )


def add_sender_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that send to other programs."""
    send = parser.add_argument_group("other programs that receive the show")
    send.add_argument(
        "--virtual-camera",
        nargs="?",
        const="",
        metavar="NAME",
        help="send the pictures to this virtual camera; without NAME to the first one",
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
        help="send the first performer as VMC (default port: 39539)",
    )
    send.add_argument(
        "--publish",
        metavar="tcp://HOST:PORT",
        help="publish the performers for other shows, whose --device is zmq+tcp://HOST:PORT",
    )
    send.add_argument(
        "--publish-keys",
        type=Path,
        metavar="DIR",
        help="the keys that --publish needs for other machines; `bunraku bridge --make-keys DIR` "
        "makes them",
    )
