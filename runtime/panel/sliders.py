"""The column at the right: sliders and switches."""

from __future__ import annotations

from imgui_bundle import imgui

from runtime.conditioning.switches import SWITCHES
from runtime.control.show_controls import ShowControls
from runtime.control.sliders import SLIDERS
from runtime.panel.widgets import card, fader, heading, switch

WIDTH = 250.0  # [px] in a picture of the usual height
OF_CHARACTERS = ("in-place", "chains")


def draw_sliders(controls: ShowControls, margin: float, scale: float) -> None:
    """Draw the column at the right."""
    with card("sliders", -margin, margin, WIDTH * scale):
        heading("Character")
        for name in SLIDERS:
            fader(name, controls)
        for name in OF_CHARACTERS:
            switch(name, controls)
        imgui.separator()
        heading("Performer")
        for name in SWITCHES:
            switch(name, controls)
