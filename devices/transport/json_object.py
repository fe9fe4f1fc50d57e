"""Parse a received message that should be one JSON object."""

from __future__ import annotations

from typing import Any

from devices.bounded_json import parse_json


def json_object(data: bytes, most_bytes: int) -> dict[str, Any]:
    """Return the JSON object in `data`; an empty one if there is none, or `data` is too long."""
    if len(data) > most_bytes:
        return {}
    try:
        message = parse_json(data)
    except ValueError:
        return {}
    return message if isinstance(message, dict) else {}
