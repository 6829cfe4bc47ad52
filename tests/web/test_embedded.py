"""The standard file with light in its pictures, in a viewer that knows nothing of lightmaps, beside our own picture."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest
from browser import SIZE, apart, picture_of_page
from khronos import validator_messages
from npm import npm_package
from PIL import Image

from app.cli import run

PAGE = """<!doctype html>
<style>body { margin: 0; background: #212224 }</style>
<script type="importmap">
  { "imports": { "three": "./node_modules/three/build/three.module.js", "three/addons/": "./node_modules/three/examples/jsm/" } }
</script>
<script type="module">
  import * as THREE from 'three';
  import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

  const gltf = await new GLTFLoader().loadAsync('baked/embedded.glb');
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  renderer.setSize(innerWidth, innerHeight);
  document.body.append(renderer.domElement);
  const camera = gltf.cameras[0];
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  renderer.render(gltf.scene, camera);
</script>
"""


@pytest.mark.parametrize("scene", ["cornell-box", "textured-room"])
def test_any_viewer_shows_it_lit(tmp_path, monkeypatch, scene):
    packages = npm_package("three@0.187.0")
    monkeypatch.chdir(tmp_path)
    solve = [scene, "--solver", "gathering", "--texels", "4000", "--rays", "32"]
    assert run(["bake", *solve, "-o", "baked", "--embed"]) == 0
    exposure = json.loads((tmp_path / "baked" / "report.json").read_text())["exposure"]
    display = ["--tone-map", "clamp", "--exposure", str(exposure), "--size", "{}x{}".format(*SIZE)]
    assert run(["shot", *solve, "-o", "viewer.png", *display]) == 0
    (tmp_path / "index.html").write_text(PAGE)
    (tmp_path / "node_modules").symlink_to(packages)
    shown = picture_of_page(tmp_path / "index.html")
    assert apart(shown, np.asarray(Image.open("viewer.png").convert("RGB"))) < 0.02
    embedded = tmp_path / "baked" / "embedded.glb"
    assert [message for message in validator_messages(embedded) if message["severity"] < 2] == []
    data = embedded.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    assert "extensionsUsed" not in json.loads(data[20 : 20 + length])
