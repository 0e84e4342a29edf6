"""CPU time and error of gVirtualXray on the spheres that `examples/speed.rs` of endowire-viewer writes.

    cargo run --profile dist -p endowire-viewer --example speed -- FOLDER
    pip install gvxr numpy && python benches/peers/gvxr.py FOLDER

Run both at once on one machine: only ratios of the same run mean anything. Time is that of all threads of the process; the error is
the mean of |L - exact| with L = ln(I0/I)/mu of water at 60 keV (0.205901 1/cm).
"""

import glob
import os
import sys
import time

import numpy as np
from gvxrPython3 import gvxr

MU_PER_MM = 0.0205901
gvxr.createWindow(-1, False, "EGL", 4, 5)
for path in sorted(glob.glob(os.path.join(sys.argv[1], "sphere_*.stl")), key=os.path.getsize):
    for side in (512, 1024):
        pitch = 0.25 * 512 / side
        gvxr.removePolygonMeshesFromSceneGraph()
        gvxr.setSourcePosition(0, -750, 0, "mm")
        gvxr.usePointSource()
        gvxr.setMonoChromatic(60, "keV", 1000)
        gvxr.setDetectorPosition(0, 250, 0, "mm")
        gvxr.setDetectorUpVector(0, 0, 1)
        gvxr.setDetectorNumberOfPixels(side, side)
        gvxr.setDetectorPixelSize(pitch, pitch, "mm")
        gvxr.loadMeshFile("sphere", path, "mm")
        gvxr.setCompound("sphere", "H2O")
        gvxr.setDensity("sphere", 1.0, "g/cm3")
        image = np.array(gvxr.computeXRayImage())
        times = []
        for _ in range(11):
            before = time.process_time()
            gvxr.computeXRayImage()
            times.append(time.process_time() - before)
        at = (np.arange(side) + 0.5 - side / 2) * pitch
        x, z = np.meshgrid(at, at)
        ray = np.stack([x, np.full_like(x, 1000.0), z], -1)
        ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
        off = np.linalg.norm(np.cross(np.broadcast_to([0, -750.0, 0], ray.shape), ray), axis=-1)
        exact = 2 * np.sqrt(np.maximum(900 - off**2, 0))
        lengths = -np.log(image / image.max()) / MU_PER_MM
        print(
            f"gvxr {os.path.basename(path)} {side}: {1e3 * np.median(times):.1f} ms CPU a frame, "
            f"mean error {np.abs(lengths - exact).mean():.1e} mm",
            flush=True,
        )
