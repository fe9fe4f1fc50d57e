"""A recording for the fuzzer without compression, so that damage reaches its content."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray

from devices.skeleton import Skeleton, SkeletonFrame
from replay.mcap.writer import McapWriter


def plain_mcap(skeleton: Skeleton, places: NDArray[np.float64]) -> bytes:
    """Two performers, one with a face, in chunks that no compression and no checksum protect.

    Args:
        skeleton: of two joints.
        places: (3, 2, 3) [m] the poses.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        with McapWriter(path, skeleton, source={"device": "sim"}) as made:
            for number in range(6):
                face = {"jawOpen": 0.5} if number % 2 else None
                turns = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
                pose = places[number // 2]
                made.write(
                    SkeletonFrame(number / 60, pose, turns, np.ones(2), number % 2, 0.1, face)
                )
        return _without_checks(path.read_bytes())


def _without_checks(packed: bytes) -> bytes:
    plain = io.BytesIO()
    reader = make_reader(io.BytesIO(packed))
    writer = Writer(plain, compression=CompressionType.NONE, enable_crcs=False)
    header = reader.get_header()
    writer.start(header.profile, header.library)
    for attachment in reader.iter_attachments():
        writer.add_attachment(
            attachment.create_time, attachment.log_time, attachment.name,
            attachment.media_type, attachment.data,
        )  # fmt: skip
    for metadata in reader.iter_metadata():
        writer.add_metadata(metadata.name, metadata.metadata)
    channels: dict[int, int] = {}
    for schema, channel, message in reader.iter_messages():
        if channel.id not in channels:
            kind = 0
            if schema is not None:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.id] = writer.register_channel(
                channel.topic, channel.message_encoding, kind, channel.metadata
            )
        writer.add_message(
            channels[channel.id], message.log_time, message.data, message.publish_time,
            message.sequence,
        )  # fmt: skip
    writer.finish()  # type: ignore[no-untyped-call]  # it has no types
    return plain.getvalue()
