"""The sliders with which a puppeteer changes how surfaces deform: squash, volume, stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from runtime.control.show_controls import ShowControls
from runtime.puppet.deformable_surface import Elasticity

STEP = 0.1  # share of a slider's range that one key press moves it
DRAGGED = 0.05  # of the range: a fader that is dragged moves by less at once, and eases itself


@dataclass(frozen=True, slots=True)
class Slider:
    """A number of the characters' surfaces, with one fader and two keys.

    Attributes:
        label: its name on the panel.
        field: its field of `Elasticity`, in [0, `most`].
        most: the fader's upper end.
        text: what the fader sets.
        hint: what its ends mean, in a few words.
        more: what the action that raises it does.
        less: what the action that lowers it does.
    """

    label: str
    field: str
    most: float
    text: str
    hint: str
    more: str
    less: str

    def read(self, controls: ShowControls) -> float:
        """Return the selected character's value as a share of the fader's range."""
        value = float(getattr(controls.selected[0].surface.elasticity, self.field))
        return min(value / self.most, 1.0)

    def write(self, controls: ShowControls, share: float) -> None:
        """Set the selected characters to a share of the fader's range."""
        for puppet in controls.selected:
            elasticity, value = puppet.surface.elasticity, share * self.most
            before = float(getattr(elasticity, self.field))
            if value == before:
                continue
            if abs(value - before) > DRAGGED * self.most or 0.0 in (value, before):
                puppet.ease()
            changed: Elasticity = replace(elasticity, **{self.field: value})
            puppet.surface.elasticity = changed

    def move(self, controls: ShowControls, by: float) -> None:
        """Move the fader by a share of its range; a value beyond its upper end stays."""
        share = self.read(controls)
        moved = min(max(share + by, 0.0), 1.0)
        if moved != share:
            self.write(controls, moved)

    def words(self, controls: ShowControls) -> str:
        """Return its name and its value."""
        return f"{self.label}: {100.0 * self.most * self.read(controls):.0f} %"


SLIDERS: Mapping[str, Slider] = {
    "cartoon": Slider(
        "Squash and stretch",
        "cartoon",
        1.0,
        "how much characters squash and stretch; 0 is not at all",
        "0 %: limbs keep their length",
        "more squash and stretch",
        "less squash and stretch",
    ),
    "volume": Slider(
        "Volume",
        "volume_gain",
        2.0,  # the middle of the fader keeps exactly the volume
        "how much volume characters keep: all of it in the middle, more above it",
        "100 %: keeps its volume exactly",
        "keep more of the volume",
        "keep less of the volume",
    ),
    "stiffness": Slider(
        "Stiffness",
        "stiffness",
        0.99,  # at 1 the deformation of a limb has no solution
        "how stiff limbs are between their joints",
        "0 %: soft as dough; 99 %: like wood",
        "stiffer limbs",
        "softer limbs",
    ),
}
