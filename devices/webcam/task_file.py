"""Makes the files that MediaPipe's tasks read: models in a zip, each with its range of pixels.

Source: TensorFlow Lite Metadata's schema (metadata_schema.fbs), and MediaPipe's
`model_asset_bundle_utils`: members are stored, not compressed.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from typing import Any

PIXELS_FROM_0_TO_1 = (0.0, 255.0)
"""Mean and deviation that a pixel from 0 to 255 is reduced and divided by."""

_METADATA = b"TFLITE_METADATA"
_STAMP = (1980, 1, 1, 0, 0, 0)  # the same models give the same bytes


def task_file(models: Mapping[str, bytes]) -> bytes:
    """Return the zip of models by their names."""
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_STORED) as archive:
        for name, model in models.items():
            archive.writestr(zipfile.ZipInfo(name, _STAMP), model)
    return memory.getvalue()


def with_pixel_range(model: bytes, mean_and_deviation: tuple[float, float]) -> bytes:
    """Return a model (.tflite) with metadata that give the range of its input's pixels.

    Raises:
        ImportError: MediaPipe is not installed.
    """
    from flatbuffers import Builder  # noqa: PLC0415  # part of an optional extra
    from mediapipe.tasks.metadata import (  # noqa: PLC0415  # an optional extra
        schema_py_generated as schema,
    )

    parsed = schema.ModelT.InitFromObj(schema.Model.GetRootAs(model, 0))
    described = schema.BufferT()
    described.data = list(_metadata(len(parsed.subgraphs[0].outputs), mean_and_deviation))
    parsed.buffers.append(described)
    entry = schema.MetadataT()
    entry.name, entry.buffer = _METADATA, len(parsed.buffers) - 1
    others = [one for one in parsed.metadata or [] if one.name != _METADATA]
    parsed.metadata = [*others, entry]
    builder = Builder(len(model))
    builder.Finish(parsed.Pack(builder), b"TFL3")
    return bytes(builder.Output())


def _metadata(outputs: int, mean_and_deviation: tuple[float, float]) -> bytes:
    """The metadata of a model of one picture and as many outputs."""
    from flatbuffers import Builder  # noqa: PLC0415  # part of an optional extra
    from mediapipe.tasks.metadata import (  # noqa: PLC0415  # an optional extra
        metadata_schema_py_generated as schema,
    )

    options = schema.NormalizationOptionsT()
    options.mean, options.std = ([value] for value in mean_and_deviation)
    unit = schema.ProcessUnitT()
    unit.optionsType, unit.options = schema.ProcessUnitOptions.NormalizationOptions, options
    image: Any = schema.TensorMetadataT()
    image.name, image.processUnits = "image", [unit]
    graph = schema.SubGraphMetadataT()
    graph.inputTensorMetadata = [image]
    graph.outputTensorMetadata = [schema.TensorMetadataT() for _ in range(outputs)]
    model = schema.ModelMetadataT()
    model.subgraphMetadata = [graph]
    builder = Builder(0)
    builder.Finish(model.Pack(builder), b"M001")
    return bytes(builder.Output())
