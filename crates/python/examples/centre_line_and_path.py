"""Find the centre line of a surface, its branches, and the path to one of its ends.

python centre_line_and_path.py [FILE]
"""

import sys

import numpy as np

import endowire

file = sys.argv[1] if len(sys.argv) > 1 else endowire.assets_path() / "vessels" / "aortic_arch.stl"
vessel = endowire.Vessel.read(file)
line = vessel.centreline  # x, y, z, radius in mm, and the row of the parent
print(f"{len(line)} points from opening {vessel.inlet}; ends: {', '.join(vessel.targets)}")
for branch in vessel.branches:
    least_mm = branch["least_radius_mm"]
    print(f"rows {branch['from']} to {branch['to']}: {branch['length_mm']:.1f} mm, radius at least {least_mm:.2f} mm")

target = next(iter(vessel.targets))
path = vessel.path(target)  # from the inlet: x, y, z, radius
length_mm = np.linalg.norm(np.diff(path[:, :3], axis=0), axis=1).sum()
print(f"to {target}: {length_mm:.1f} mm, narrowest {path[:, 3].min():.2f} mm")
np.savetxt("centre_line.csv", line, delimiter=",", header="x_mm,y_mm,z_mm,radius_mm,parent", comments="")
