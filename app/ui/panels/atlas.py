"""The virtual atlas as a picture in the Inspect panel: light and leaves, and what the leaf under the pointer is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from app.session.picking import leaf_at
from app.ui import theme, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

REFRESH_SECONDS = 0.25  # between two pictures of it
MOST_PX = 512  # along its longer edge
WORTH_TURNING = 1.2  # times as large
LEAST_EM = 11.0  # height of what is left of the panel, below which the picture makes the panel scroll


@dataclass(frozen=True)
class Place:
    """Where the picture is: left and top [display units], and display units per texel of level 0. turned: u is up, v right."""

    left: float
    top: float
    scale: float
    atlas: tuple[int, int]
    turned: bool

    @property
    def size(self) -> imgui.ImVec2:
        width, height = self.atlas[::-1] if self.turned else self.atlas
        return imgui.ImVec2(max(width * self.scale, 1.0), max(height * self.scale, 1.0))

    def screen_from_atlas(self, u: float, v: float) -> imgui.ImVec2:
        right, up = (v, u) if self.turned else (u, v)
        return imgui.ImVec2(self.left + right * self.scale, self.top + self.size.y - up * self.scale)

    def atlas_from_screen(self, at: imgui.ImVec2) -> tuple[float, float]:
        right, up = (at.x - self.left) / self.scale, (self.top + self.size.y - at.y) / self.scale
        return (up, right) if self.turned else (right, up)


def draw(view: View, state: State) -> None:
    """The picture as large as the panel has room for; made only while it is in sight."""
    place = _place(view.session.charts.size, state.ratio)
    image = _image(view, state, place) if imgui.is_rect_visible(place.size) else None
    if image is None or state.texture_id is None:
        imgui.dummy(place.size)
        return
    imgui.image(imgui.ImTextureRef(state.texture_id(image)), place.size, imgui.ImVec2(0, 1), imgui.ImVec2(1, 0))
    if imgui.is_item_hovered():
        _leaf(view, place)


def _place(atlas: tuple[int, int], ratio: float) -> Place:
    """Turned where it is much larger so."""
    width, corner = widgets.steady_width(), imgui.get_cursor_screen_pos()
    height = max(imgui.get_content_region_avail().y, LEAST_EM * imgui.get_font_size())
    upright, turned = (min(width / across, height / tall) for across, tall in (atlas, atlas[::-1]))
    turns = turned > WORTH_TURNING * upright
    scale = min(turned if turns else upright, theme.px(MOST_PX) / ratio / max(atlas))
    return Place(corner.x, corner.y, max(scale, 1e-3), atlas, turns)


def _image(view: View, state: State, place: Place) -> Any:
    """Made anew a few times a second, and whenever it is of another size or the textures behind it may be others."""
    pixels = max(round(place.size.x * state.ratio), 1), max(round(place.size.y * state.ratio), 1)
    source = view.session.lightmap, view.display, pixels, place.turned
    state.inset_age += imgui.get_io().delta_time
    known = state.inset
    if known is None or known[1] is None or known[0] != source or state.inset_age >= REFRESH_SECONDS:
        known = state.inset = source, view.atlas_image(pixels, turned=place.turned)
        state.inset_age = 0.0
    return known[1]


def _leaf(view: View, place: Place) -> None:
    """Frame the leaf under the pointer, and say what it is."""
    leaf = leaf_at(view.session.lightmap, place.atlas_from_screen(imgui.get_mouse_pos()))
    if leaf is None:
        return
    one, other = place.screen_from_atlas(*leaf.rect[:2]), place.screen_from_atlas(*leaf.rect[2:])
    low, high = (imgui.ImVec2(pick(one.x, other.x), pick(one.y, other.y)) for pick in (min, max))
    imgui.get_window_draw_list().add_rect(low, high, theme.colour_u32(theme.TEXT))
    imgui.begin_tooltip()
    imgui.text_unformatted(f"Level {leaf.level}")
    imgui.text_unformatted(f"{leaf.texels} texels of {widgets.number(leaf.texel * 1e3, 3)} mm")
    imgui.end_tooltip()
