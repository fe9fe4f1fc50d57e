"""Options of files can be given only once."""

from __future__ import annotations

import pytest

from devices.errors import InputError
from runtime.cli import parser

OPTIONS = ("--video", "--frames", "--cache", "--report", "--record", "--export")


@pytest.mark.parametrize("option", OPTIONS)
def test_a_second_file_of_a_kind_is_refused(option: str) -> None:
    assert parser().parse_args(["demo", option, "a.x"])
    with pytest.raises(InputError, match=f"{option}.*given twice"):
        parser().parse_args(["demo", option, "a.x", option, "b.x"])
