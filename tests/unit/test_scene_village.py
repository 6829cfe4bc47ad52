"""The village: a surface of unit faces that is closed to below, of any size, the same everywhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scene_files import written
from scipy.ndimage import label

from app.atlas.parametrize import parametrize
from app.atlas.texels import texel_count
from app.errors import SceneError
from app.scene.authored import load_authored
from app.scene.blocks import Blocks
from app.scene.library import scene_path
from app.scene.load import load_scene
from app.scene.model import F64, Scene
from app.scene.shapes import Mesh
from app.scene.village import Village

SMALL = 80
PAPER = 63_125  # patches [Shcherbakov19]


def village(folder: Path, parameters: str) -> Scene:
    text = scene_path("village").read_text()
    assert text.count("blocks = 140\n") == 1
    return load_authored(written(folder, "village.toml", text.replace("blocks = 140\n", parameters + "\n")))


def faces(world: Blocks) -> int:
    return sum(len(faces.u) for faces in world.faces())


def corners(pieces: list[tuple[str, str, Mesh]]) -> F64:
    return np.concatenate([mesh.positions[mesh.triangles] for _, _, mesh in pieces])


def test_it_has_as_many_patches_as_the_papers_scene() -> None:
    scene = load_scene("village")
    area = float(scene.normals_areas[1].sum())
    moon = scene.normals_areas[1][[scene.objects[i] == "moon" for i in scene.object_ids]].sum()
    assert area - moon == faces(Village(kind="village").world()) == pytest.approx(PAPER, rel=0.03)
    assert len(scene.triangles) < 0.75 * area


def test_a_face_is_about_a_texel_at_one_a_metre(tmp_path: Path) -> None:
    """Of rectangles just that, but where their sides are rounded to whole patches; other pieces of ground lie across texels."""
    scene = village(tmp_path, f"blocks = {SMALL}")
    charts = parametrize(scene, density=1.0)
    assert charts.warnings == ()
    area = np.bincount(charts.face_chart, scene.normals_areas[1][charts.face_triangle])
    width, height = charts.chart_rects[:, 2:].T
    exact = np.abs(width * height - area) < 1e-6
    assert exact.mean() > 0.8
    assert area.sum() < texel_count(charts) < 1.25 * area.sum()


def test_neighbours_share_whole_edges_and_nothing_is_open_but_the_ends_of_the_world() -> None:
    world = Village(kind="village", blocks=SMALL).world()
    start = np.round(2 * corners(world.pieces())).astype(np.int64)  # middles of rectangles lie at halves
    start -= start.min(axis=(0, 1))
    code = start @ [1, 1 << 20, 1 << 40]
    one, other = code.reshape(-1), np.roll(code, -1, axis=1).reshape(-1)
    there, back = ({*map(tuple, np.stack(pair, axis=1).tolist())} for pair in ((one, other), (other, one)))
    most = 2 * SMALL
    for edge in there ^ back:
        x, z = zip(*((end & 0xFFFFF, end >> 40) for end in edge), strict=True)
        assert set(x) in ({0}, {most}) or set(z) in ({0}, {most})


def test_ground_closes_the_world_to_below() -> None:
    """The areas of all faces add up to the world's floor plan, looking up: nothing is missing, nothing is twice."""
    triangles = corners(Village(kind="village", blocks=SMALL).world().pieces())
    a, b, c = np.moveaxis(triangles, 1, 0)
    normals = np.cross(b - a, c - a)
    assert normals[:, 1].sum() / 2 == SMALL**2
    assert np.abs(normals).max(axis=1).sum() / 2 == faces(Village(kind="village", blocks=SMALL).world())


def test_a_seed_is_one_village_and_another_seed_another() -> None:
    one, same, other = (corners(Village(kind="village", blocks=SMALL, seed=s).pieces()) for s in (3, 3, 4))
    assert np.array_equal(one, same)
    assert one.shape != other.shape or not np.array_equal(one, other)


def test_it_grows_with_its_area() -> None:
    small, large = (faces(Village(kind="village", blocks=n).world()) for n in (SMALL, 2 * SMALL))
    assert 15_000 < small < 25_000 and 3.5 < large / small < 4.5


def test_lamps_and_rooms_are_where_they_belong() -> None:
    scene = load_scene("village")
    names = set(scene.objects)
    assert {"terrain, grass", "cave, stone", "house 1, plaster", "tree 3, leaves", "lantern 1, lantern"} <= names
    assert [c.name for c in scene.cameras] == ["square", "house", "cave", "overview"]
    lit = {scene.materials[i].name for i in np.unique(scene.material_ids) if scene.materials[i].emits}
    assert lit == {"lantern", "lamp", "window", "torch", "moon"}


def test_cameras_stand_in_the_air() -> None:
    world = Village(kind="village").world()
    for camera in load_scene("village").cameras:
        cell = tuple(np.floor(camera.world_from_camera[:3, 3]).astype(int) - world.lowest)
        assert world.material[cell] == 0, camera.name


@pytest.mark.parametrize("blocks", [SMALL, 140])
def test_a_tunnel_leads_from_the_square_into_the_cave(blocks: int) -> None:
    made = Village(kind="village", blocks=blocks)
    world = made.world()
    head = (
        1 - world.lowest[1]
    ).item()  # y = 1, where a head is: only on foot, neither over the hill nor through its roof
    places, _ = label(world.material[:, head] == 0)
    square, hall = (places[0 - world.lowest[0], z - world.lowest[2]] for z in (-7, made.hill))
    assert square == hall > 0
    assert world.material[-world.lowest[0], head + 8, made.hill - world.lowest[2]] != 0  # a roof above the hall


@pytest.mark.parametrize(
    ("parameters", "reason"),
    [
        ("blocks = 78", "village.blocks: Input should be greater than or equal to 80"),
        ("blocks = 1002", "village.blocks: Input should be less than or equal to 1000"),
        ("blocks = 81", "village.blocks: Input should be a multiple of 2"),
        ("seed = -1", "village.seed: Input should be greater than or equal to 0"),
        ("houses = 4", "village.houses: Extra inputs are not permitted"),
    ],
)
def test_parameters_that_make_no_village_are_refused_in_one_line(tmp_path: Path, parameters: str, reason: str) -> None:
    with pytest.raises(SceneError) as caught:
        village(tmp_path, parameters)
    assert reason in str(caught.value) and "\n" not in str(caught.value)
