"""Build a wheel that carries the machine code of all kernels: `compiled_wheel.py [FOLDER]`.

The wheel is for this version of Python and this platform. It is compiled for x86-64-v3 from an
empty cache, and requires exactly the numba and llvmlite that compiled it. Elsewhere, and on an
older processor, kernels are compiled at the first start as in a checkout.
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

CHECKOUT = Path(__file__).resolve().parents[1]
PROCESSOR = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""}
INSIDE = "solvers/kernels/machine_code"
PINNED = ("numba", "llvmlite")


def build(out: Path) -> Path:
    """Compile all kernels, build the wheel of this checkout and put both into one; its path."""
    with tempfile.TemporaryDirectory() as folder:
        home = dict.fromkeys(("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME"), folder)
        compiled = _python(
            "from runtime.cli.warm import warm_up; from solvers.kernels.cache import FOLDER; "
            "warm_up(); print(FOLDER)",
            {**home, **PROCESSOR},
        )
        pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", folder, "."]
        subprocess.run(pip, cwd=CHECKOUT, check=True)
        (plain,) = Path(folder).glob("*.whl")
        out.mkdir(parents=True, exist_ok=True)
        return pack(plain, Path(compiled), out, {name: version(name) for name in PINNED})


def pack(plain: Path, compiled: Path, out: Path, pins: Mapping[str, str]) -> Path:
    """Put a folder of machine code into a copy of a pure wheel, in the folder `out`; its path."""
    with ZipFile(plain) as wheel:
        files = {name: wheel.read(name) for name in wheel.namelist()}
    for path in sorted(compiled.iterdir()):
        files[f"{INSIDE}/{path.name}"] = path.read_bytes()
    (info,) = {name.split("/")[0] for name in files if name.split("/")[0].endswith(".dist-info")}
    for name, edit in (("WHEEL", _for_this_platform), ("METADATA", lambda text: _pin(text, pins))):
        files[f"{info}/{name}"] = edit(files[f"{info}/{name}"].decode()).encode()
    record = f"{info}/RECORD"
    lines = [f"{name},{_hash(data)},{len(data)}" for name, data in files.items() if name != record]
    files[record] = "\n".join([*lines, f"{record},,", ""]).encode()
    packed = out / plain.name.replace("py3-none-any", _tag())
    with ZipFile(packed, "w", ZIP_DEFLATED) as wheel:
        for name, data in files.items():
            wheel.writestr(name, data)
    return packed


def _python(code: str, environment: Mapping[str, str]) -> str:
    run = subprocess.run(
        [sys.executable, "-c", code],
        cwd=CHECKOUT,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return run.stdout.strip()


def _tag() -> str:
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    return f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"


def _for_this_platform(text: str) -> str:
    text = text.replace("Root-Is-Purelib: true", "Root-Is-Purelib: false")
    return text.replace("Tag: py3-none-any", f"Tag: {_tag()}")


def _pin(text: str, pins: Mapping[str, str]) -> str:
    for name, exact in pins.items():
        text = re.sub(
            rf"^Requires-Dist: {name}\b[^;\n]*", f"Requires-Dist: {name}=={exact}", text, flags=re.M
        )
    return text


def _hash(data: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=")
    return f"sha256={digest.decode()}"


if __name__ == "__main__":
    print(build(Path(sys.argv[1] if len(sys.argv) > 1 else "dist")))  # noqa: T201  # a command that prints its file
