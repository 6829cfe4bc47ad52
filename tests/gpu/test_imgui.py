"""The Dear ImGui renderer: text, images, scissor, scale, growing textures, shader reload, clean release."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import moderngl
import numpy as np
import pytest
from imgui_bundle import imgui

from app.gpu import Gpu
from app.gpu.imgui import ImguiRenderer
from app.viewer.ui_frame import pixels

SIZE = (320, 200)
BACKGROUND = np.array([26, 51, 77])
ORANGE = (255, 128, 0, 255)


class Screen:
    """A Dear ImGui context, a renderer and a target; ``show`` draws frames of what ``build`` builds."""

    def __init__(self, gpu: Gpu, ratio: int = 1) -> None:
        self.gpu, self.ratio = gpu, ratio
        self.context = imgui.create_context()
        imgui.set_current_context(self.context)
        self.io = imgui.get_io()
        self.io.set_ini_filename(None)
        self.io.display_size = imgui.ImVec2(*SIZE)
        self.io.display_framebuffer_scale = imgui.ImVec2(ratio, ratio)
        self.size = (SIZE[0] * ratio, SIZE[1] * ratio)
        self.made: list[moderngl.Texture] = []
        self.renderer = ImguiRenderer(gpu)
        self.texture = gpu.texture(self.size, 4, "f1")
        self.target = gpu.target(self.texture)

    def show(self, build: Callable[[], None], frames: int = 2) -> np.ndarray:
        for _ in range(frames):
            imgui.new_frame()
            build()
            imgui.render()
            self.target.clear(*BACKGROUND / 255, 1.0)
            self.renderer.draw(self.target, imgui.get_draw_data())
        return pixels(self.target, self.size).astype(int)

    def release(self) -> None:
        self.renderer.release()
        self.gpu.ctx.detect_framebuffer(0).use()  # moderngl would bind the last one again
        self.target.release()
        self.texture.release()
        imgui.destroy_context(self.context)


@pytest.fixture(params=[1, 2], ids=["ratio1", "ratio2"])
def screen(gpu: Gpu, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Screen]:
    screen = Screen(gpu, request.param)
    make = gpu.texture
    monkeypatch.setattr(gpu, "texture", lambda *a, **k: screen.made.append(make(*a, **k)) or screen.made[-1])
    yield screen
    screen.release()


def window(
    content: Callable[[], None], position: tuple[int, int] = (20, 30), size: tuple[int, int] = (160, 120)
) -> None:
    """A bare window without any padding, so that its content starts at its corner."""
    imgui.set_next_window_pos(imgui.ImVec2(*position))
    imgui.set_next_window_size(imgui.ImVec2(*size))
    imgui.push_style_var(imgui.StyleVar_.window_padding, imgui.ImVec2(0, 0))
    imgui.push_style_var(imgui.StyleVar_.window_border_size, 0.0)
    imgui.begin("test", None, imgui.WindowFlags_.no_decoration)
    content()
    imgui.end()
    imgui.pop_style_var(2)


def test_image_lands_where_it_should(gpu: Gpu, screen: Screen) -> None:
    colours = np.zeros((2, 2, 4), np.uint8)
    colours[0], colours[1] = ORANGE, (0, 0, 255, 255)
    image = gpu.texture((2, 2), 4, "f1", colours.tobytes())
    build = lambda: window(  # noqa: E731
        lambda: imgui.image(imgui.ImTextureRef(screen.renderer.texture_id(image)), imgui.ImVec2(40, 40))
    )
    shown = screen.show(build)
    r = screen.ratio
    assert tuple(shown[40 * r, 30 * r]) == ORANGE[:3]  # first row of the texture on top
    assert tuple(shown[60 * r, 30 * r]) == (0, 0, 255)
    outside = np.ones(shown.shape[:2], bool)
    outside[30 * r : 150 * r, 20 * r : 180 * r] = False
    assert (shown[outside] == BACKGROUND).all()
    image.release()


def test_text_is_white_on_the_window(screen: Screen) -> None:
    shown = screen.show(lambda: window(lambda: imgui.text("Radiosity B")))
    r = screen.ratio
    text = shown[30 * r : 45 * r, 20 * r : 100 * r].min(axis=-1)
    assert text.max() > 200  # strokes
    assert (text > 200).mean() < 0.5  # and not a white block: glyphs were looked up
    assert shown[60 * r :, 20 * r : 180 * r][: 80 * r].min(axis=-1).max() < 100  # nothing below the line


def test_content_is_clipped_by_its_window(screen: Screen) -> None:
    def content() -> None:
        low, high = imgui.ImVec2(0, 0), imgui.ImVec2(*SIZE)
        imgui.get_window_draw_list().add_rect_filled(low, high, imgui.IM_COL32(*ORANGE))

    shown = screen.show(lambda: window(content))
    orange = (shown == ORANGE[:3]).all(axis=-1)
    r = screen.ratio
    assert orange[30 * r : 150 * r, 20 * r : 180 * r].all()
    assert orange.sum() == 160 * 120 * r * r


def test_colours_blend_over_what_is_there(screen: Screen) -> None:
    half = imgui.IM_COL32(255, 255, 255, 128)
    corner = imgui.ImVec2(10, 10)
    shown = screen.show(lambda: imgui.get_background_draw_list().add_rect_filled(imgui.ImVec2(0, 0), corner, half))
    expected = (255 * 128 + BACKGROUND * 127) / 255
    assert np.abs(shown[5, 5] - expected).max() <= 1  # rounding to 8 bits


def test_font_texture_grows(screen: Screen) -> None:
    def sizes() -> list[tuple[int, int]]:
        return [(t.width, t.height) for t in imgui.get_platform_io().textures if t.tex_id]

    screen.show(lambda: window(lambda: imgui.text("a")))
    before = sizes()

    def large() -> None:
        imgui.push_font(None, 90.0)
        imgui.text("ABCDEFG")
        imgui.text("abcdefghijklm")
        imgui.pop_font()

    shown = screen.show(lambda: window(large, (0, 0), SIZE), frames=4)
    assert max(w * h for w, h in sizes()) > max(w * h for w, h in before)
    assert (shown.min(axis=-1) > 200).mean() > 0.05  # large letters are there


def test_later_glyphs_reach_the_texture(gpu: Gpu, screen: Screen) -> None:
    """Dear ImGui draws glyphs into its own pixels as they are first used; the GPU's copy must follow."""
    for text in ("a", "bcd", "EFGH ij 123"):
        screen.show(lambda text=text: window(lambda: imgui.text(text)), frames=1)
        for texture in imgui.get_platform_io().textures:
            ours = next(t for t in screen.made if t.glo == texture.tex_id)
            assert ours.read() == texture.get_pixels_array().tobytes()


def test_windows_do_not_share_vertices(screen: Screen) -> None:
    """Each window has its own list of vertices; all go into one buffer."""
    colours = (ORANGE, (0, 0, 255, 255), (0, 255, 0, 255))

    def build() -> None:
        for index, colour in enumerate(colours):
            imgui.set_next_window_pos(imgui.ImVec2(20 + 60 * index, 30))
            imgui.set_next_window_size(imgui.ImVec2(40, 40))
            imgui.push_style_color(imgui.Col_.window_bg, imgui.IM_COL32(*colour))
            imgui.begin(f"window {index}", None, imgui.WindowFlags_.no_decoration)
            imgui.end()
            imgui.pop_style_color()

    shown = screen.show(build)
    for index, colour in enumerate(colours):
        centre = shown[50 * screen.ratio, (40 + 60 * index) * screen.ratio]
        assert tuple(centre) == colour[:3]


def test_more_vertices_than_16_bits_number(screen: Screen) -> None:
    def content() -> None:
        draw_list = imgui.get_background_draw_list()
        for _ in range(20_000):  # 80,000 vertices
            draw_list.add_rect_filled(imgui.ImVec2(0, 0), imgui.ImVec2(1, 1), imgui.IM_COL32(0, 0, 255, 255))
        draw_list.add_rect_filled(imgui.ImVec2(50, 50), imgui.ImVec2(60, 60), imgui.IM_COL32(*ORANGE))

    shown = screen.show(content)
    assert (shown == ORANGE[:3]).all(axis=-1).sum() == (10 * screen.ratio) ** 2


def test_a_shader_reload_changes_nothing(gpu: Gpu, screen: Screen) -> None:
    build = lambda: window(lambda: imgui.text("again"))  # noqa: E731
    before = screen.show(build)
    gpu.shaders.reload()
    assert (screen.show(build) == before).all()


def test_release_gives_everything_back(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Any] = []
    for name in ("texture", "buffer", "vertex_array"):
        make = getattr(moderngl.Context, name)
        monkeypatch.setattr(moderngl.Context, name, lambda *a, _make=make, **k: made.append(_make(*a, **k)) or made[-1])
    screen = Screen(gpu)
    screen.show(lambda: window(lambda: imgui.text("once")))
    textures = list(imgui.get_platform_io().textures)
    screen.release()
    assert textures and len(made) >= 5
    assert all(isinstance(resource.mglo, moderngl.InvalidObject) for resource in made)
