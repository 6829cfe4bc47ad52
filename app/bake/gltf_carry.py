"""A glTF document taken over from a file into a GLB under construction: all of it but its meshes, whose vertices are new.

Nodes, their names and ``extras``, materials, pictures byte for byte, samplers, cameras, lights and animations keep their numbers.
Pictures in files of their own are embedded. What cannot stay: skins and morph targets, since meshes are posed as the light fell
on them, compression of meshes, and scenes other than the one that is shown.
"""

from __future__ import annotations

import copy
import json
from pathlib import PurePosixPath
from typing import Any

from app import __version__
from app.bake.glb import GlbBuilder
from app.scene.gltf_file import GltfFile

NEW = ("meshes", "accessors", "bufferViews", "buffers", "skins", "scenes", "scene")
OF_MESHES = ("EXT_mesh_gpu_instancing", "KHR_draco_mesh_compression", "KHR_mesh_quantization")
MAGIC = {b"\x89PNG": "image/png", b"\xff\xd8\xff": "image/jpeg", b"RIFF": "image/webp", b"\xabKTX": "image/ktx2"}


class CarriedGlb(GlbBuilder):
    """A GLB that begins with what a file has. given: the file's whole JSON; roots: the nodes of its scene; scene: its other
    properties."""

    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self.given: dict[str, Any] = json.loads(file.text)
        kept = {kind: copy.deepcopy(items) for kind, items in self.given.items() if kind not in NEW}
        super().__init__(f"glowtree {__version__}", kept)
        self._accessors: dict[int, int] = {}
        for name in OF_MESHES:
            self.drop_extension(name)
        nodes = self.document.get("nodes", [])
        scenes = self.given.get("scenes", [])
        self.scene: dict[str, Any] = dict(scenes[self.given.get("scene", 0)]) if scenes else {}
        children = {child for node in nodes for child in node.get("children", ())}
        self.roots: list[int] = self.scene.get("nodes", [i for i in range(len(nodes)) if i not in children])
        for node in nodes:
            for gone in ("mesh", "skin", "weights"):
                node.pop(gone, None)
            drop(node, "extensions", "EXT_mesh_gpu_instancing")
        self._take_views([items for kind, items in self.document.items() if kind != "images"])
        self._take_images()
        self._take_animations()

    def accessor(self, index: int) -> int:
        """One of the file's accessors as it is there; its new number."""
        if index not in self._accessors:
            item = copy.deepcopy(self.given["accessors"][index])
            self._take_views(item)
            self._accessors[index] = self.add("accessors", item)
        return self._accessors[index]

    def _take_images(self) -> None:
        for number, image in enumerate(self.document.get("images", ())):
            source = self._file.document.images[number]
            if source.buffer_view is not None:
                image["bufferView"] = self._view(source.buffer_view)
            elif source.uri is not None:
                self._embed(image, source.uri)

    def _embed(self, image: dict[str, Any], uri: str) -> None:
        """An image by its bytes; as it is where its file cannot be read."""
        data = self._file.resource(uri)
        kind = None if data is None else kind_of(data)
        if data is None or kind is None:
            return
        if not uri.startswith("data:"):
            image.setdefault("name", PurePosixPath(uri).stem)
        image.pop("uri")
        image |= {"bufferView": self.add_view(data, {}), "mimeType": kind}

    def _take_animations(self) -> None:
        """All of them but for weights of morph targets."""
        kept = []
        for animation in self.document.pop("animations", ()):
            animation["channels"] = [c for c in animation["channels"] if c["target"].get("path") != "weights"]
            used = sorted({channel["sampler"] for channel in animation["channels"]})
            animation["samplers"] = [animation["samplers"][i] for i in used]
            for channel in animation["channels"]:
                channel["sampler"] = used.index(channel["sampler"])
            for sampler in animation["samplers"]:
                sampler |= {end: self.accessor(sampler[end]) for end in ("input", "output")}
            if animation["channels"]:
                kept.append(animation)
        if kept:
            self.document["animations"] = kept

    def _take_views(self, item: Any) -> None:
        """Let all that names a buffer view name that with the same bytes here."""
        if isinstance(item, list):
            for one in item:
                self._take_views(one)
        elif isinstance(item, dict):
            for name, value in item.items():
                if name == "bufferView" and isinstance(value, int):
                    item[name] = self._view(value)
                elif name != "extras":
                    self._take_views(value)

    def _view(self, index: int) -> int:
        about = self.given["bufferViews"][index]
        extra = {name: about[name] for name in ("byteStride", "target", "name", "extras") if name in about}
        return self.add_view(bytes(self._file.view(index)), extra)


def kind_of(picture: bytes) -> str | None:
    """The media type of a picture, by its first bytes."""
    return next((kind for magic, kind in MAGIC.items() if picture.startswith(magic)), None)


def drop(item: dict[str, Any], kind: str, name: str) -> None:
    """Leave out ``item[kind][name]``, and an ``item[kind]`` that has nothing else."""
    if kind in item:
        item[kind].pop(name, None)
        if not item[kind]:
            item.pop(kind)
