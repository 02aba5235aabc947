"""Blender (bpy): Freestyle or Line Art over a Cycles picture. Their sets of lines are not those of object ids: contours where
a body folds over itself are among them, so only time is compared."""

import math
import os
import sys
import time

import bpy


def prepare(path, width, height, samples):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    scene = bpy.context.scene
    scene.camera = next(thing for thing in scene.objects if thing.type == "CAMERA")
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy = 3.0
    light = bpy.data.objects.new("sun", sun)
    light.rotation_euler = (math.radians(40), 0, math.radians(48))
    scene.collection.objects.link(light)
    scene.render.engine = "CYCLES"
    scene.cycles.samples = samples
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.threads_mode = "AUTO"
    return scene


def with_freestyle(scene):
    scene.render.use_freestyle = True
    scene.render.line_thickness = 2.0
    view = bpy.context.view_layer
    view.use_freestyle = True
    lines = view.freestyle_settings.linesets.new("lines")
    lines.linestyle = bpy.data.linestyles.new("ink")
    lines.linestyle.thickness = 2.0
    lines.select_silhouette = lines.select_border = lines.select_crease = True


def with_line_art(scene):
    data = bpy.data.grease_pencils.new("ink")
    data.layers.new("lines").frames.new(1)
    ink = bpy.data.materials.new("ink")
    bpy.data.materials.create_gpencil_data(ink)
    data.materials.append(ink)
    pencil = bpy.data.objects.new("ink", data)
    scene.collection.objects.link(pencil)
    modifier = pencil.modifiers.new("lines", "LINEART")
    modifier.source_type = "SCENE"
    modifier.target_layer = "lines"
    modifier.target_material = ink
    modifier.use_contour = modifier.use_intersection = modifier.use_crease = True
    return pencil


def main(path, width, height, samples, how):
    start = time.process_time()
    scene = prepare(path, width, height, samples)
    loaded = time.process_time()
    bpy.ops.render.render()
    plain = time.process_time() - loaded
    begun = time.process_time()
    if how == "freestyle":
        with_freestyle(scene)
        scene.render.filepath = os.path.abspath(f"freestyle_{samples}.png")
        bpy.ops.render.render(write_still=True)
        lined = time.process_time() - begun
    else:
        pencil = with_line_art(scene)
        bpy.context.view_layer.update()
        evaluated = pencil.evaluated_get(bpy.context.evaluated_depsgraph_get())
        strokes = sum(len(layer.frames[0].drawing.strokes) for layer in evaluated.data.layers if layer.frames)
        assert strokes > 0, "Line Art drew nothing"
        # Drawing the strokes needs a GPU, which a machine for rendering may not have: this is the time to find them.
        lined = plain + time.process_time() - begun
    print({"load": loaded - start, "render": plain, "lines": lined - plain, "samples": samples})


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:5]), sys.argv[5])
