"""A wheel carries machine code, and a program uses it where the processor can."""

from __future__ import annotations

import csv
import importlib.util
import io
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from zipfile import ZipFile

import pytest

from solvers.kernels import processor

CHECKOUT = Path(__file__).resolve().parents[1]
METADATA = """Metadata-Version: 2.4
Name: bunraku
Requires-Dist: numba<0.69,>=0.68
Requires-Dist: llvmlite<0.51,>=0.50
Requires-Dist: numpy>=1.26
"""
WHEEL = "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
HASWELL = dict.fromkeys(processor._FEATURES, True)


@pytest.fixture(scope="module")
def compiled_wheel() -> ModuleType:
    path = CHECKOUT / "scripts" / "compiled_wheel.py"
    spec = importlib.util.spec_from_file_location("compiled_wheel", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_wheel_gets_the_machine_code_its_platform_and_exact_versions(
    compiled_wheel: ModuleType, tmp_path: Path
) -> None:
    plain, code = tmp_path / "bunraku-0.1.0-py3-none-any.whl", tmp_path / "kernels"
    info = "bunraku-0.1.0.dist-info"
    with ZipFile(plain, "w") as wheel:
        wheel.writestr("solvers/__init__.py", "")
        for name, text in (("METADATA", METADATA), ("WHEEL", WHEEL), ("RECORD", "of before")):
            wheel.writestr(f"{info}/{name}", text)
    code.mkdir()
    (code / "arap.solve-0-1.nbc").write_bytes(b"machine code")
    pins = {"numba": "0.68.1", "llvmlite": "0.50.0"}
    packed = compiled_wheel.pack(plain, code, tmp_path, pins)
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    assert packed.name.startswith(f"bunraku-0.1.0-{python}-{python}-")
    with ZipFile(packed) as wheel:
        files = {name: wheel.read(name) for name in wheel.namelist()}
    assert files["solvers/kernels/machine_code/arap.solve-0-1.nbc"] == b"machine code"
    assert f"Tag: {python}-{python}-" in files[f"{info}/WHEEL"].decode()
    assert "Root-Is-Purelib: false" in files[f"{info}/WHEEL"].decode()
    required = files[f"{info}/METADATA"].decode().splitlines()[2:]
    assert required == [
        "Requires-Dist: numba==0.68.1",
        "Requires-Dist: llvmlite==0.50.0",
        "Requires-Dist: numpy>=1.26",
    ]
    rows = list(csv.reader(io.StringIO(files[f"{info}/RECORD"].decode())))
    assert {row[0] for row in rows} == set(files)
    for name, digest, length in rows:
        if not name.endswith("RECORD"):
            assert digest == compiled_wheel._hash(files[name])
            assert int(length) == len(files[name])


def test_machine_code_goes_where_the_program_looks_for_it(compiled_wheel: ModuleType) -> None:
    assert processor.PACKED == CHECKOUT / compiled_wheel.INSIDE
    assert compiled_wheel.PROCESSOR["NUMBA_CPU_NAME"] == processor.NAME


@pytest.mark.parametrize("lacking", processor._FEATURES)
def test_a_processor_that_lacks_something_compiles_for_itself(lacking: str) -> None:
    assert processor.runs_packed(HASWELL)
    assert not processor.runs_packed({**HASWELL, lacking: False})
    assert not processor.runs_packed({})


@pytest.mark.parametrize(
    ("packed", "loaded", "asked", "able", "chosen"),
    [
        (True, False, None, True, "x86-64-v3"),
        (True, False, None, False, None),
        (False, False, None, True, None),  # a checkout
        (True, True, None, True, None),  # numba has chosen
        (True, False, "generic", True, "generic"),
    ],
)
def test_the_processor_is_chosen_before_numba_is_loaded(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    packed: bool,
    loaded: bool,
    asked: str | None,
    able: bool,
    chosen: str | None,
) -> None:
    environment: dict[str, str] = {} if asked is None else {"NUMBA_CPU_NAME": asked}
    monkeypatch.setattr(processor, "os", SimpleNamespace(environ=environment))
    monkeypatch.setattr(processor, "PACKED", tmp_path if packed else tmp_path / "none")
    monkeypatch.setattr(processor, "_host_features", lambda: HASWELL if able else {})
    if loaded:
        monkeypatch.setitem(sys.modules, "numba", ModuleType("numba"))
    else:
        monkeypatch.delitem(sys.modules, "numba", raising=False)
    processor.choose_processor()
    assert environment.get("NUMBA_CPU_NAME") == chosen
