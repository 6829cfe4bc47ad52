"""A lightmap baked by Blender's Cycles: ``python blender_worker.py IN OUT SAMPLES DENOISE``, on a Python that has ``bpy``.

Knows nothing of glowtree. IN is an .npz that blender.py writes; OUT gets the irradiance (h, w, 3), row 0 at v = 0, the seconds
and CPU seconds of the bake, and Blender's version. DENOISE 1 filters with Open Image Denoise's lightmap filter, in that time.
"""

import json
import sys
import time

import bpy
import numpy as np

MARGIN = 16  # texels that are filled around each chart: as Blender has it, and the filter sees no black gaps
BOUNCES = 1024  # as good as no limit: paths end by chance


def main(source, target, samples, denoise):
    given = dict(np.load(source))
    width, height = (int(side) for side in given["size"])
    scene = bpy.data.scenes.new("bake")
    bpy.context.window_manager.windows[0].scene = scene
    image = bpy.data.images.new("lightmap", width, height, float_buffer=True, is_data=True)
    target_object = bpy.data.objects.new("scene", mesh_of(given, image))
    scene.collection.objects.link(target_object)
    set_up(scene, samples)
    view_layer = scene.view_layers[0]
    view_layer.objects.active = target_object
    target_object.select_set(True, view_layer=view_layer)
    start, cpu = time.perf_counter(), time.process_time()
    with bpy.context.temp_override(
        scene=scene,
        view_layer=view_layer,
        active_object=target_object,
        object=target_object,
        selected_objects=[target_object],
    ):
        bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, margin=MARGIN, uv_layer="lightmap")
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    light = np.ascontiguousarray(pixels.reshape(height, width, 4)[..., :3])
    if denoise:
        light = denoised(light)
    seconds = time.perf_counter() - start, time.process_time() - cpu
    # what is baked is the radiance of a white surface
    np.savez(target, irradiance=np.pi * light, seconds=seconds, made=f"Blender {bpy.app.version_string}")


def set_up(scene, samples):
    """Path tracing without shortcuts that make it darker."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.seed = "CPU", samples, 1
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = BOUNCES
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0
    scene.render.bake.margin_type = "EXTEND"
    scene.render.bake.use_clear = True


def mesh_of(given, image):
    """Triangles (m, 3, 3) with a layer of coordinates for the lightmap and for each kind of texture."""
    corners = given["corners"]
    mesh = bpy.data.meshes.new("scene")
    mesh.from_pydata(corners.reshape(-1, 3).tolist(), [], np.arange(3 * len(corners)).reshape(-1, 3).tolist())
    for name in ("lightmap", "albedo", "emission"):
        layer = mesh.uv_layers.new(name=name)
        layer.data.foreach_set("uv", given[f"uv_{name}"].astype(np.float32).ravel())
    for k, material in enumerate(json.loads(str(given["materials"]))):
        mesh.materials.append(material_of(k, material, given, image))
    mesh.polygons.foreach_set("material_index", given["material"].astype(np.int32))
    mesh.update()
    return mesh


def material_of(k, described, given, image):
    """Diffuse, and it emits; black from behind."""
    material = bpy.data.materials.new(f"material {k}")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()

    def node(kind):
        return tree.nodes.new(kind)

    def coloured(kind):
        pixels = given.get(f"{kind}_{k}")
        if pixels is None:
            colour = node("ShaderNodeRGB")
            colour.outputs[0].default_value = (*described[kind], 1.0)
            return colour.outputs[0]
        rows, columns = pixels.shape[:2]
        picture = bpy.data.images.new(f"{kind} {k}", columns, rows, float_buffer=True, is_data=True)
        picture.pixels.foreach_set(np.dstack([pixels[::-1], np.ones((rows, columns))]).astype(np.float32).ravel())
        place, texture = node("ShaderNodeUVMap"), node("ShaderNodeTexImage")
        place.uv_map, texture.image = kind, picture
        texture.interpolation, texture.extension = described[f"{kind}_look_up"]
        tree.links.new(place.outputs[0], texture.inputs[0])
        return texture.outputs[0]

    diffuse, emission, both = node("ShaderNodeBsdfDiffuse"), node("ShaderNodeEmission"), node("ShaderNodeAddShader")
    black, side, mixed = node("ShaderNodeBsdfDiffuse"), node("ShaderNodeNewGeometry"), node("ShaderNodeMixShader")
    black.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    output, baked = node("ShaderNodeOutputMaterial"), node("ShaderNodeTexImage")
    tree.links.new(coloured("albedo"), diffuse.inputs["Color"])
    front = diffuse.outputs[0]
    if described["emits"]:
        tree.links.new(coloured("emission"), emission.inputs["Color"])
        tree.links.new(diffuse.outputs[0], both.inputs[0])
        tree.links.new(emission.outputs[0], both.inputs[1])
        front = both.outputs[0]
    tree.links.new(side.outputs["Backfacing"], mixed.inputs[0])
    tree.links.new(front, mixed.inputs[1])
    tree.links.new(black.outputs[0], mixed.inputs[2])
    tree.links.new(mixed.outputs[0], output.inputs["Surface"])
    baked.image = image
    tree.nodes.active = baked
    material.cycles.emission_sampling = "FRONT" if described["emits"] else "NONE"
    return material


def denoised(light):
    import pyoidn

    return pyoidn.denoise(light, filter_type="RTLightmap")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4] == "1")
