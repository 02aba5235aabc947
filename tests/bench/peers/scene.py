"""What all peers share: the meshes and the camera of a GLB, lines from object ids, and the error of their coverage."""

import json
import struct
from pathlib import Path

import numpy as np

WIDTH_PX = 2.0
"""Full width of lines in pixels."""


def read_glb(path):
    """Meshes in world space [(name, vertices, faces)], and the first camera: (camera to world, vertical field of view, name)."""
    data = Path(path).read_bytes()
    length, = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20:20 + length])
    binary = memoryview(data)[20 + length + 8:]

    def accessor(index):
        entry = document["accessors"][index]
        view = document["bufferViews"][entry["bufferView"]]
        kind = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}[entry["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[entry["type"]]
        start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        assert view.get("byteStride", 0) in (0, width * np.dtype(kind).itemsize), "interleaved buffers are not read"
        return np.frombuffer(binary, kind, entry["count"] * width, start).reshape(-1, width)

    meshes, cameras = [], []

    def local(node):
        if "matrix" in node:
            return np.array(node["matrix"], float).reshape(4, 4).T
        x, y, z, w = node.get("rotation", (0, 0, 0, 1))
        turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                         [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                         [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
        matrix = np.eye(4)
        matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), float)
        matrix[:3, 3] = node.get("translation", (0, 0, 0))
        return matrix

    def visit(index, parent):
        node = document["nodes"][index]
        matrix = parent @ local(node)
        if "mesh" in node:
            for part in document["meshes"][node["mesh"]]["primitives"]:
                vertices = accessor(part["attributes"]["POSITION"]).astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
                faces = accessor(part["indices"]).reshape(-1, 3).astype(np.int64)
                meshes.append((node.get("name", f"object{len(meshes)}"), vertices, faces))
        if "camera" in node:
            camera = document["cameras"][node["camera"]]
            cameras.append((matrix, camera["perspective"]["yfov"], camera.get("name", node.get("name"))))
        for child in node.get("children", ()):
            visit(child, matrix)

    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        visit(root, np.eye(4))
    return meshes, cameras[0]


def rays(camera, size, side, rows):
    """Origins and directions through the middles of side x side cells of each pixel of some rows of cells."""
    matrix, fov, _ = camera
    width, height = size[0] * side, size[1] * side
    tangent = np.tan(fov / 2)
    x = ((np.arange(width) + 0.5) / width * 2 - 1) * tangent * size[0] / size[1]
    y = (1 - (np.arange(*rows) + 0.5) / height * 2) * tangent
    directions = np.empty((len(y), width, 3), np.float32)
    directions[..., 0], directions[..., 1], directions[..., 2] = x[None, :], y[:, None], -1
    directions = directions.reshape(-1, 3) @ matrix[:3, :3].T.astype(np.float32)
    origins = np.broadcast_to(matrix[:3, 3].astype(np.float32), directions.shape)
    return np.ascontiguousarray(origins), np.ascontiguousarray(directions)


def coverage(ids, side):
    """How much of each pixel lines cover: cells that have a cell of another id within half the width.

    The edge lies half a cell before the first cell beyond it, by which the reach is longer.
    """
    reach = WIDTH_PX / 2 * side + 0.5
    height, width = ids.shape
    lined = np.zeros(ids.shape, bool)
    whole = int(np.ceil(reach))
    for dy in range(0, whole + 1):
        for dx in range(-whole, whole + 1):
            if (dy == 0 and dx <= 0) or dx * dx + dy * dy >= reach * reach:
                continue
            here = ids[:height - dy, max(0, -dx):width - max(0, dx)]
            there = ids[dy:, max(0, dx):width - max(0, -dx)]
            differ = here != there
            lined[:height - dy, max(0, -dx):width - max(0, dx)] |= differ
            lined[dy:, max(0, dx):width - max(0, -dx)] |= differ
    return lined.reshape(height // side, side, width // side, side).mean(axis=(1, 3))


def coverage_error(test, reference):
    """The share of the lines' area that is wrong."""
    return float(np.abs(test - reference).sum() / reference.sum())
