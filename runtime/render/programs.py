"""Compile shader programs from the files in shaders/."""

from __future__ import annotations

import re
from importlib import resources
from typing import Protocol

import moderngl

INCLUDE = re.compile(r'^#include "(\w+\.glsl)"$', re.MULTILINE)
FRAME_BINDING = 0


def link(
    context: moderngl.Context, vertex: str, fragment: str, *, defines: tuple[str, ...] = ()
) -> moderngl.Program:
    """Compile `shaders/<vertex>.vert` with `shaders/<fragment>.frag` for OpenGL 3.3."""
    program = context.program(
        vertex_shader=_source(f"{vertex}.vert", defines),
        fragment_shader=_source(f"{fragment}.frag", defines),
    )
    block = program.get("Frame", None)
    if isinstance(block, moderngl.UniformBlock):
        block.binding = FRAME_BINDING
    return program


def _source(name: str, defines: tuple[str, ...]) -> str:
    head = "".join(f"#define {define}\n" for define in defines)
    return f"#version 330 core\n{head}{INCLUDE.sub(lambda hit: _read(hit[1]), _read(name))}"


def _read(name: str) -> str:
    return resources.files("runtime.render").joinpath("shaders", name).read_text("utf-8")


class Releasable(Protocol):
    """An owner of GL objects."""

    def release(self) -> None:
        """Free the GL objects."""


def release_all(*things: Releasable | None) -> None:
    """Release the things that are not None, in the order given."""
    for thing in things:
        if thing is not None:
            thing.release()
