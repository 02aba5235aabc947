"""Mitsuba 3: shape indices as an extra channel at side x side cells of each pixel, and lines where they differ; beside them a
picture with direct light and the same samples."""

import sys
import time

import mitsuba as mi
import numpy as np

import scene

mi.set_variant("scalar_rgb")


def prepare(path, size, side):
    meshes, (matrix, fov, _) = scene.read_glb(path)
    # Mitsuba's cameras look along +z with x to the left.
    turned = matrix @ np.diag([-1.0, 1.0, -1.0, 1.0])
    description = {
        "type": "scene",
        "integrator": {"type": "aov", "aovs": "id:shape_index", "light": {"type": "direct"}},
        "sensor": {
            "type": "perspective", "fov": float(np.degrees(fov)), "fov_axis": "y",
            "to_world": mi.ScalarTransform4f(turned.tolist()),
            "film": {"type": "hdrfilm", "width": size[0] * side, "height": size[1] * side,
                     "rfilter": {"type": "box"}, "pixel_format": "rgb"},
            "sampler": {"type": "stratified", "sample_count": 1, "jitter": False},
        },
        "sun": {"type": "directional", "direction": [-0.45, -0.8, -0.4], "irradiance": 3.0},
    }
    for index, (_, vertices, faces) in enumerate(meshes):
        mesh = mi.Mesh(f"mesh{index}", len(vertices), len(faces))
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
        parameters["faces"] = faces.astype(np.uint32).ravel()
        parameters.update()
        description[f"mesh{index}"] = mesh
    return mi.load_dict(description)


def main(path, width, height, side):
    start = time.process_time()
    world = prepare(path, (width, height), side)
    built = time.process_time()
    pixels = np.array(mi.render(world, spp=1))
    traced = time.process_time()
    # Shapes are counted from 1; what leaves the scene has none.
    covered = scene.coverage(np.rint(pixels[..., -1]).astype(np.int16), side)
    done = time.process_time()
    np.save(f"mitsuba_{side * side}.npy", covered)
    print({"load": built - start, "render": traced - built, "lines": done - traced, "samples": side * side})


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:5]))
