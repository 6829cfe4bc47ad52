"""Files that lie about themselves: one clear line or a counted repair, and nothing else, whatever the bytes."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scene_files import QUAD, QUAD_UV, Gltf, glb_bytes, quad_gltf, written

from app.errors import SceneError
from app.scene.gltf import load_gltf
from app.scene.load import load_scene
from app.scene.model import Scene


def load(folder: Path, data: bytes, name: str = "a.glb") -> Scene:
    return load_gltf(written(folder, name, data))


def drop_factor(gltf: Gltf) -> None:
    gltf.json["images"] = [{"uri": "none.png"}]
    del gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"]


def no_uv(gltf: Gltf) -> None:
    del gltf.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]


def points_too(gltf: Gltf) -> None:
    gltf.json["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 0})


def nan_uv(gltf: Gltf) -> None:
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = gltf.accessor(np.full_like(QUAD_UV, np.nan))


def merge(path: str, value: Any) -> Callable[[Gltf], None]:
    """An edit that sets one value of the JSON, e.g. ``nodes.0.mesh``."""

    def edit(gltf: Gltf) -> None:
        at: Any = gltf.json
        *steps, last = [int(s) if s.isdigit() else s for s in path.split(".")]
        for step in steps:
            at = at[step]
        if isinstance(last, int) and last == len(at):
            at.append(value)
        else:
            at[last] = value

    return edit


REPAIRED: dict[str, tuple[Callable[[Gltf], None], str]] = {
    "missing picture": (merge("images.0", {"uri": "none.png"}), "1 picture is missing"),
    "missing picture, no factor": (drop_factor, "1 picture is missing"),
    "broken picture": (merge("images.0.bufferView", 0), "1 picture could not be read"),
    "no picture": (merge("textures.0", {}), "1 texture without a picture"),
    "far coordinates": (merge("materials.0.emissiveTexture", {"index": 0, "texCoord": 2}), "TEXCOORD_2"),
    "unlit": (merge("materials.0.extensions", {"KHR_materials_unlit": {}}), "1 unlit material"),
    "albedo": (
        merge("materials.0.pbrMetallicRoughness.baseColorFactor", [2, -1, 0, 1]),
        "albedo above 0.99: held there",
    ),
    "emission": (merge("materials.0.emissiveFactor", [-1, 0, 0]), "emission below 0"),
    "no material": (lambda g: g.json["meshes"][0]["primitives"][0].pop("material") and None, "without material"),
    "no uv": (no_uv, "2 textured triangles without texture coordinates"),
    "nan uv": (nan_uv, "2 textured triangles without texture coordinates"),
    "points": (points_too, "1 primitive without triangles"),
    "orthographic": (merge("cameras.0", {"type": "orthographic"}), "1 camera without perspective"),
    "zero yfov": (merge("cameras.0.perspective.yfov", 0), "1 camera was dropped"),
}


@pytest.mark.parametrize("name", REPAIRED)
def test_repaired_with_a_counted_warning(tmp_path: Path, name: str) -> None:
    edit, warning = REPAIRED[name]
    gltf = quad_gltf()
    edit(gltf)
    scene = load(tmp_path, gltf.glb())
    assert any(warning in w for w in scene.warnings), scene.warnings
    assert all(0.0 <= x <= 1.0 for m in scene.materials for x in m.albedo)
    assert scene.uv0 is None or np.isfinite(scene.uv0).all()


def test_missing_picture_leaves_the_factor_or_grey(tmp_path: Path) -> None:
    gltf = quad_gltf()
    gltf.json["images"] = [{"uri": "none.png"}]
    assert load(tmp_path, gltf.glb()).materials[0].albedo == (0.1234, 0.0019, 0.75)
    drop_factor(gltf)
    assert load(tmp_path, gltf.glb()).materials[0].albedo == (0.5, 0.5, 0.5)


def quad_with(value: float) -> Gltf:
    """The quad with one coordinate of the vertex that both triangles share replaced."""
    positions = QUAD.copy()
    positions[2, 1] = value
    return quad_gltf(positions)


HOSTILE: dict[str, tuple[Callable[[Gltf], None] | Gltf, str]] = {
    "nan": (quad_with(np.nan), "2 of 2 triangles have a corner that is not a finite number"),
    "inf": (quad_with(np.inf), "2 of 2 triangles have a corner that is not a finite number"),
    "index out of range": (quad_gltf(indices=np.array([0, 1, 60000], np.uint16)), "index 60000 is out of range"),
    "flat": (quad_gltf(QUAD * np.float32(0)), "no triangle has an area (2 given)"),
    "line": (quad_gltf(QUAD * np.array([1, 0, 0], np.float32)), "no triangle has an area (2 given)"),
    "no indices": (merge("accessors.3.count", 0), "no triangles"),
    "half a triangle": (merge("accessors.3.count", 4), "no whole number of triangles"),
    "no nodes": (merge("scenes.0.nodes", []), "no triangles"),
    "cycle": (merge("nodes.0.children", [0]), "cycle"),
    "long cycle": (lambda g: (merge("nodes.0.children", [1])(g), merge("nodes.1.children", [0])(g)) and None, "cycle"),
    "two parents": (merge("nodes.2", {"children": [0]}), "no triangles|twice"),
    "required extension": (merge("extensionsRequired", ["EXT_magic"]), "EXT_magic"),
    "meshopt": (merge("extensionsRequired", ["EXT_meshopt_compression"]), "compressed with meshopt"),
    "meshopt, not required": (
        merge("buffers", [{"byteLength": 9, "extensions": {"EXT_meshopt_compression": {"fallback": True}}}]),
        "compressed with meshopt (EXT_meshopt_compression); write it uncompressed",
    ),
    "KTX2": (
        merge("extensionsRequired", ["KHR_texture_basisu"]),
        "compressed with KTX2 (KHR_texture_basisu); write its",
    ),
    "version 1": (merge("asset.version", "1.0"), "version 1.0"),
    "no asset": (merge("asset", {}), "asset.version"),
    "mesh": (merge("nodes.0.mesh", 7), "mesh 7 does not exist: there are 1"),
    "light": (
        merge("nodes.0.extensions", {"KHR_lights_punctual": {"light": 0}}),
        "light 0 does not exist: there are 0",
    ),
    "material": (merge("meshes.0.primitives.0.material", 3), "material 3 does not exist"),
    "texture": (merge("materials.0.emissiveTexture", {"index": 9}), "texture 9 does not exist"),
    "accessor": (merge("meshes.0.primitives.0.indices", 99), "accessor 99 does not exist"),
    "negative accessor": (merge("meshes.0.primitives.0.indices", -1), "indices"),
    "view": (merge("accessors.0.bufferView", 99), "bufferView 99 does not exist"),
    "view end": (merge("bufferViews.0.byteLength", 10**6), "reaches past the end of buffer 0"),
    "accessor end": (merge("accessors.0.count", 5), "accessor 0 needs 60 bytes"),
    "accessor offset": (merge("accessors.0.byteOffset", 2**52), "accessor 0 needs"),
    "stride": (merge("bufferViews.0.byteStride", 4), "stride"),
    "huge count": (merge("accessors.0", {"componentType": 5126, "type": "VEC3", "count": 2**31 - 1}), "at most"),
    "component type": (merge("accessors.0.componentType", 1), "componentType"),
    "scalar position": (merge("accessors.0.type", "SCALAR"), "accessor 0 is SCALAR: VEC3 is needed"),
    "uv count": (merge("accessors.1.count", 3), "3 TEXCOORD_0 for 4 POSITION"),
    "float indices": (merge("meshes.0.primitives.0.indices", 4), "unsigned whole numbers"),
    "buffer file": (merge("buffers", [{"byteLength": 4, "uri": "../x.bin"}]), "'../x.bin' is not a readable file"),
    "buffer data": (merge("buffers", [{"byteLength": 4, "uri": "data:;base64,@@"}]), "is not a readable file"),
    "buffer size": (merge("buffers", [{"byteLength": 10**9}]), "buffer 0 is truncated"),
    "scene": (merge("scene", 4), "scene 4 does not exist"),
    "string": (merge("nodes.0.translation", "up"), "nodes.0.translation"),
    "huge scale": (merge("nodes.0.scale", [1e300, 1e300, 1]), "m across"),
    "overflow": (merge("nodes.0.scale", [1e308, 1e308, 1e308]), "m across|not a finite number"),
    "emission": (merge("materials.0.emissiveFactor", [1e308, 1e308, 1e308]), "must be finite"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_file_gives_one_clear_line(tmp_path: Path, name: str) -> None:
    edit, reason = HOSTILE[name]
    gltf = copy.deepcopy(edit) if isinstance(edit, Gltf) else quad_gltf()
    if name == "float indices":
        gltf.accessor(np.array([0, 1, 2], np.float32))
    if callable(edit):
        edit(gltf)
    if name == "two parents":
        gltf.json["scenes"] = [{"nodes": [2, 0]}]
    with pytest.raises(SceneError) as caught:
        load(tmp_path, gltf.glb())
    message = str(caught.value)
    assert any(r in message for r in reason.split("|")) and "\n" not in message, message
    assert message.startswith(str(tmp_path / "a.glb"))


NOT_GLTF = {
    "empty": b"",
    "magic only": b"glTF",
    "text": b"hello",
    "list": b"[]",
    "open": b"{",
    "number": b'{"asset": 3}',
    "other json": b'{"a": 1}',
    "nan": b'{"asset": {"version": "2.0"}, "nodes": [{"scale": [NaN, 1, 1]}]}',
    "huge int": b'{"asset": {"version": "2.0"}, "scene": ' + b"9" * 400 + b"}",
    "deep": b'{"asset": ' + b"[" * 100_000,
    "not utf-8": b'{"asset": {"version": "\xff"}}',
    "version 1 glb": glb_bytes(b"{}", b"").replace(b"glTF\x02", b"glTF\x01"),
    "chunk length": glb_bytes(b"{}  ", b"")[:12] + b"\xff\xff\xff\x7f" + glb_bytes(b"{}  ", b"")[16:],
    "file length": b"glTF\x02\0\0\0\xff\xff\xff\xff" + bytes(20),
    "no json chunk": b"glTF\x02\0\0\0\x14\0\0\0" + bytes(8),
    "empty json": glb_bytes(b"{}", b""),
}


@pytest.mark.parametrize("name", NOT_GLTF)
def test_not_a_gltf(tmp_path: Path, name: str) -> None:
    with pytest.raises(SceneError) as caught:
        load(tmp_path, NOT_GLTF[name])
    assert "\n" not in str(caught.value)


def test_truncated_at_every_length(tmp_path: Path) -> None:
    data = quad_gltf().glb()
    for length in range(len(data)):
        with pytest.raises(SceneError):
            load(tmp_path, data[:length])


def outcome(folder: Path, data: bytes) -> Scene | SceneError:
    """What loading gives; anything but a sound Scene or a SceneError of one line fails the test."""
    try:
        scene = load_scene(written(folder, "a.glb", data))
    except SceneError as error:
        assert "\n" not in str(error)
        return error
    assert np.isfinite(scene.positions).all() and len(scene.triangles) > 0
    assert scene.triangles.min() >= 0 and scene.triangles.max() < len(scene.positions)
    assert scene.material_ids.max() < len(scene.materials) and scene.object_ids.max() < len(scene.objects)
    normals, areas = scene.normals_areas
    assert np.isfinite(normals).all() and (areas > 0.0).all()
    for camera in scene.cameras:
        assert np.isfinite(camera.world_from_camera).all()
    return scene


fuzzed = settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@fuzzed
@given(data=st.data())
def test_fuzz_bytes(tmp_path: Path, data: st.DataObject) -> None:
    glb = bytearray(quad_gltf().glb())
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(1, len(glb) - 1))
        match data.draw(st.sampled_from(["set", "insert", "delete", "cut"])):
            case "set":
                glb[at] = data.draw(st.integers(0, 255))
            case "insert":
                glb[at:at] = data.draw(st.binary(max_size=8))
            case "delete":
                del glb[at : at + data.draw(st.integers(1, 8))]
            case "cut":
                del glb[at + 1 :]
        if len(glb) < 2:
            break
    outcome(tmp_path, bytes(glb))


ODD = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**65), 2**65),
    st.integers(-2, 12),
    st.floats(),
    st.text(max_size=6),
    st.just([]),
    st.just({}),
    st.lists(st.integers(-1, 4), max_size=4),
)


@fuzzed
@given(data=st.data())
def test_fuzz_json(tmp_path: Path, data: st.DataObject) -> None:
    gltf = quad_gltf()
    gltf.json["buffers"] = [{"byteLength": len(gltf.data)}]
    for _ in range(data.draw(st.integers(1, 3))):
        at: Any = gltf.json
        while True:
            keys: list[Any] = list(at) if isinstance(at, dict) else list(range(len(at)))
            if not keys:
                break
            key = data.draw(st.sampled_from(keys))
            inner = at[key]
            if isinstance(inner, (dict, list)) and inner and data.draw(st.integers(0, 7)):
                at = inner
                continue
            if data.draw(st.booleans()) or isinstance(at, list):
                at[key] = data.draw(ODD)
            else:
                del at[key]
            break
    text = json.dumps(gltf.json).encode()
    outcome(tmp_path, glb_bytes(text, bytes(gltf.data)))
