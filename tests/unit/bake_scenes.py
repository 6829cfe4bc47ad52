"""Small scenes with hand-made charts for the tests of baking: every case of lit and dark sides."""

from __future__ import annotations

import dataclasses

import numpy as np

from app.atlas.charts import DEFAULT_TILE, Charts
from app.scene.model import Camera, Material, Scene, Texture

CELL = 8  # texels: every face gets a cell of its own, its triangle one texel away from the border
CELLS = 4  # per row of the atlas
LIT = {  # object: (front has a chart, back has a chart)
    "wall": (True, False),
    "sheet": (True, True),
    "card": (False, True),
    "plate": (True, False),
    "hidden": (False, False),
}
MATERIAL = {"wall": 0, "sheet": 1, "card": 2, "plate": 2, "hidden": 1}


def materials() -> tuple[Material, ...]:
    levels = np.random.default_rng(3).integers(0, 256, (4, 8, 3)) / 255.0
    pixels = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4).astype(np.float32)
    turned = np.array([[0.0, 2.0, 0.25], [-3.0, 0.0, 0.5]])  # a quarter turn with scale (3, 2)
    picture = Texture("picture", pixels, ("clamp", "mirror"), bilinear=False, uv_transform=turned)
    return (
        Material("plaster", (0.7, 0.6, 0.5), albedo_texture=picture),
        Material("lamp", (0.1, 0.1, 0.1), (20.0, 10.0, 5.0), emission_texture=picture, double_sided=True),
        Material("paper", (0.8, 0.8, 0.8), (0.5, 0.25, 0.0), double_sided=True),
        Material("dark", (0.2, 0.2, 0.2)),
    )


def sides_scene(centre=(0.0, 0.0, 0.0)) -> Scene:
    """One square of two triangles for each entry of LIT, one behind the other, with UVs, normals and two cameras."""
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    count = len(LIT)
    positions = np.concatenate([square + np.array([0.0, 0.1 * i, 0.5 * i]) for i in range(count)]) + centre
    triangles = (4 * np.arange(count)[:, None, None] + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3).astype(np.int32)
    pose = np.eye(4)
    pose[:3, 3] = np.array([0.5, 0.5, 3.0]) + centre
    return Scene(
        name="sides",
        positions=positions,
        triangles=triangles,
        material_ids=np.repeat([MATERIAL[name] for name in LIT], 2).astype(np.int32),
        object_ids=np.repeat(np.arange(count), 2).astype(np.int32),
        objects=tuple(LIT),
        materials=materials(),
        cameras=(Camera("near", pose, 0.8), Camera("same", pose, 1.2)),
        uv0=(positions - centre)[triangles][:, :, :2].astype(np.float32),
        normals=np.tile(np.float32([0.0, 0.0, 1.0]), (2 * count, 3, 1)),
    )


def sides_charts(scene: Scene) -> Charts:
    """A chart of one triangle for each lit side that LIT names."""
    faces = [(t, b) for t, o in enumerate(scene.object_ids) for b in (0, 1) if LIT[scene.objects[o]][b]]
    count = len(faces)
    corner = CELL * np.stack([np.arange(count) % CELLS, np.arange(count) // CELLS], -1)
    rows = -(-count // CELLS)
    return Charts(
        size=(CELL * CELLS, CELL * (rows + rows % 2)),
        tile=DEFAULT_TILE,
        density=6.0,
        face_triangle=np.array([t for t, _ in faces], np.int32),
        face_back=np.array([b for _, b in faces], bool),
        face_uv=(corner[:, None] + np.array([[1, 1], [7, 1], [1, 7]])).astype(np.float64),
        face_chart=np.arange(count, dtype=np.int32),
        face_facet=np.arange(count, dtype=np.int32),
        chart_rects=np.c_[corner + 1, np.full((count, 2), 6)].astype(np.int32),
        dark_faces=0,
        method="by hand",
    )


def with_second_uv_set(scene: Scene, *, for_albedo: bool) -> Scene:
    """The scene with its pictures (or only those of emission) on a second UV set, the first one mirrored."""
    moved = []
    for material in scene.materials:
        albedo, emission = material.albedo_texture, material.emission_texture
        if albedo is not None and for_albedo:
            albedo = dataclasses.replace(albedo, texcoord=1)
        if emission is not None:
            albedo = albedo or emission
            emission = dataclasses.replace(emission, texcoord=1)
        moved.append(dataclasses.replace(material, albedo_texture=albedo, emission_texture=emission))
    assert scene.uv0 is not None
    return dataclasses.replace(scene, materials=tuple(moved), uv1=1 - scene.uv0)


def owners(uv: np.ndarray, size: tuple[int, int], per_texel: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """How many triangles ``uv`` (f, 3, 2) [texels] cover each sample point of the atlas, and the last one that does."""
    width, height = size
    steps = (np.arange(per_texel) + 0.5) / per_texel
    x = (np.arange(width)[:, None] + steps).ravel()
    y = (np.arange(height)[:, None] + steps).ravel()
    covers, owner = np.zeros((len(y), len(x)), int), np.full((len(y), len(x)), -1)
    for face, corners in enumerate(uv):
        a, b, c = corners
        inside = np.ones(covers.shape, bool)
        turn = np.sign((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= turn * ((q[0] - p[0]) * (y[:, None] - p[1]) - (q[1] - p[1]) * (x - p[0])) > 1e-9
        covers += inside
        owner[inside] = face
    return covers, owner
