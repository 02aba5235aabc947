"""Embree (through embreex): object ids at side x side cells of each pixel, and lines where they differ."""

import sys
import time

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

import scene


def ids(tree, owners, camera, size, side):
    rows = size[1] * side
    strip = max(1, 4_000_000 // (size[0] * side))
    out = np.empty((rows, size[0] * side), np.int16)
    for first in range(0, rows, strip):
        last = min(rows, first + strip)
        hit = tree.run(*scene.rays(camera, size, side, (first, last)))
        out[first:last] = np.where(hit >= 0, owners[hit], -1).reshape(last - first, -1)
    return out


def prepare(path):
    meshes, camera = scene.read_glb(path)
    tree = rtcore_scene.EmbreeScene()
    triangles = np.concatenate([vertices[faces] for _, vertices, faces in meshes]).astype(np.float32)
    TriangleMesh(tree, triangles)
    owners = np.concatenate([np.full(len(faces), index, np.int16) for index, (_, _, faces) in enumerate(meshes)])
    return tree, owners, camera


def reference(path, size, side=16):
    """The coverage of lines with many cells, row by row of pixels in strips that overlap."""
    tree, owners, camera = prepare(path)
    return scene.coverage(ids(tree, owners, camera, size, side), side)


def main(path, width, height, side):
    size = (width, height)
    start = time.process_time()
    tree, owners, camera = prepare(path)
    tree.run(*scene.rays(camera, size, 1, (0, 1)))
    built = time.process_time()
    found = ids(tree, owners, camera, size, side)
    traced = time.process_time()
    covered = scene.coverage(found, side)
    done = time.process_time()
    np.save(f"embree_{side * side}.npy", covered)
    print({"load": built - start, "render": traced - built, "lines": done - traced, "samples": side * side})


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:5]))
