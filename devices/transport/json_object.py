"""Parse a received message that should be one JSON object."""

from __future__ import annotations

import json
from typing import Any


def json_object(data: bytes, most_bytes: int) -> dict[str, Any]:
    """Return the JSON object in `data`; an empty one if there is none, or `data` is too long."""
    if len(data) > most_bytes:
        return {}
    try:
        message = json.loads(data)
    except (ValueError, RecursionError):
        return {}
    return message if isinstance(message, dict) else {}
