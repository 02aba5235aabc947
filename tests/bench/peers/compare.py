"""Renders one model with Tusche and with what of its peers is installed, and prints a table.

    python compare.py MODEL.glb --tusche PATH/TO/tusche [--size 640x360] [--sides 1,2,3,4,6]

Peers are found by import: embreex, mitsuba, bpy (`pip install embreex mitsuba bpy numpy pillow`). Tusche, Embree and Mitsuba draw
lines 2 px wide where object ids differ; their coverage is compared with one of 16 x 16 Embree rays a pixel. Blender has other
lines, so it is compared by time at equal samples. Times are CPU seconds, summed over threads, so that other programs on the machine
matter little.
"""

import argparse
import ast
import datetime
import importlib.metadata
import importlib.util
import json
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import scene

HERE = Path(__file__).parent


def run(script, model, size, *arguments):
    command = [sys.executable, str(HERE / script), str(model), *map(str, size), *map(str, arguments)]
    out = subprocess.run(command, capture_output=True, text=True)
    if out.returncode != 0:
        return None, out.stderr.strip().splitlines()[-1:]
    return ast.literal_eval(out.stdout.strip().splitlines()[-1]), None


def tusche(program, model, camera, size, samples):
    """A shaded picture with lines, and their coverage: two files of one run."""
    settings = ["lines.width=2.0", "lines.object=true", "lines.shader=false", "lines.normal=false", 'render.filter="box"', "render.filter_radius=0.5"]
    flags = [part for setting in settings for part in ("--set", setting)]
    command = [program, "render", str(model), "--size", f"{size[0]}x{size[1]}", "--samples", str(samples), "--camera", camera, *flags]
    subprocess.run([*command, "--quiet", "-o", "lined.png", "--stats", "stats.json"], check=True)
    subprocess.run([*command, "--quiet", "--layer", "line", "-o", "line.png"], check=True)
    line = np.asarray(Image.open("line.png").convert("RGBA"), float)[..., 3] / 255
    seconds = json.loads(Path("stats.json").read_text())["seconds"]
    return line, {"load": seconds["load"] + seconds["build"],
                  "picture": sum(seconds[stage] for stage in ("trace", "shade", "lines", "film"))}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path)
    parser.add_argument("--tusche", required=True)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--sides", default="1,2,3,4,6")
    parser.add_argument("--keep", help="a folder for the pictures")
    options = parser.parse_args()
    size = tuple(map(int, options.size.split("x")))
    sides = list(map(int, options.sides.split(",")))
    model, program = options.model.resolve(), str(Path(options.tusche).resolve())
    known = {name: importlib.metadata.version(name) for name in ("embreex", "mitsuba", "bpy") if importlib.util.find_spec(name)}
    if "embreex" not in known:
        sys.exit("the reference needs embreex: pip install embreex")
    folder = options.keep or tempfile.mkdtemp()
    os.makedirs(folder, exist_ok=True)
    os.chdir(folder)

    import embree_lines
    camera = scene.read_glb(model)[1][2]
    reference = embree_lines.reference(model, size)
    rows = []
    for side in sides:
        samples = side * side
        line, times = tusche(program, model, camera, size, samples)
        rows.append(("Tusche, lit, lines", samples, times["load"], times["picture"],
                     scene.coverage_error(line, reference)))
    for name, script in (("embreex", "embree_lines.py"), ("mitsuba", "mitsuba_lines.py")):
        for side in sides if name in known else ():
            found, fault = run(script, model, size, side)
            if found is None:
                print(f"{name} failed: {fault}", file=sys.stderr)
                break
            lines = np.load(f"{'embree' if name == 'embreex' else name}_{side * side}.npy")
            label = {"embreex": "Embree, ids alone, lines in numpy", "mitsuba": "Mitsuba, lit, lines in numpy"}[name]
            rows.append((label, side * side, found["load"], found["render"] + found["lines"],
                         scene.coverage_error(lines, reference)))
    for how, label in (("freestyle", "Blender Cycles, Freestyle"), ("line_art", "Blender Cycles, Line Art (strokes found, not drawn)")):
        for side in (1, 4) if "bpy" in known else ():
            found, fault = run("blender_lines.py", model, size, side * side, how)
            if found is None:
                print(f"{label} failed: {fault}", file=sys.stderr)
                break
            rows.append((label, side * side, found["load"], found["render"] + found["lines"], None))

    print(f"{model.name}, {size[0]} x {size[1]}, {datetime.date.today()}, {os.cpu_count()} CPUs ({platform.machine()}), "
          + ", ".join(f"{name} {version}" for name, version in known.items()))
    print("\n| renderer | samples | load, CPU s | picture with lines, CPU s | line coverage error |\n|---|---|---|---|---|")
    for label, samples, load, took, error in rows:
        told = "other lines" if error is None else f"{100 * error:.1f} %"
        print(f"| {label} | {samples} | {load:.2f} | {took:.2f} | {told} |")


if __name__ == "__main__":
    main()
