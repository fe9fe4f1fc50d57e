"""What the sink takes, another maker's reader gives back, message by message."""

from __future__ import annotations

import tempfile
from contextlib import closing
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from replay.mcap.record_writer import CHUNK_BYTES, McapRecordWriter
from tests.thorough import examples

SIZES = st.sampled_from((0, 1, 5_000, CHUNK_BYTES - 1, CHUNK_BYTES, 3 * CHUNK_BYTES))


@given(st.lists(st.tuples(SIZES, st.integers(1, 2), st.booleans()), max_size=8))
@settings(deadline=None, max_examples=examples(40))
def test_messages_of_any_size_come_back(wishes: list[tuple[int, int, bool]]) -> None:
    """In chunks that end where they are full or handed on, longer and shorter than the last."""
    sent = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        with closing(McapRecordWriter(path)) as sink:
            schema = sink.schema("any", "{}")
            for topic in "ab":
                sink.channel(topic, schema)
            for number, (size, channel, flush) in enumerate(wishes):
                data = bytes([number + 1]) * size
                sink.message(
                    channel, data, log_time=number, publish_time=2 * number, sequence=3 * number
                )
                sent.append(("ab"[channel - 1], data, number, 2 * number, 3 * number))
                if flush:
                    sink.flush()
            sink.finish()
        with path.open("rb") as file:
            found = [
                (
                    channel.topic,
                    message.data,
                    message.log_time,
                    message.publish_time,
                    message.sequence,
                )
                for _, channel, message in make_reader(file, validate_crcs=True).iter_messages()
            ]
    assert found == sent
