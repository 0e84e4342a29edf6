"""Read a surface file of your own, see what was mended, and push a wire into it.

python my_own_surface.py [FILE]      STL, OBJ, PLY, VTP or VTK
"""

import sys

import endowire

file = sys.argv[1] if len(sys.argv) > 1 else endowire.assets_path() / "vessels" / "curved_tube.stl"
vessel = endowire.Vessel.read(file, unit_mm=1.0)  # 10.0 for a file in centimetres; axes="RAS" if it has those
print(f"{len(vessel.triangles)} triangles, {len(vessel.repairs)} repairs")
for opening in vessel.openings:
    print(f"opening {opening['index']}: radius {opening['radius_mm']:.1f} mm at {opening['centre_mm']}")

wire = endowire.Instrument.uniform(length_mm=400.0, radius_mm=0.3, bending_stiffness_nmm2=5.0)
simulation = endowire.Simulation(vessel, wire, opening=0, depth_mm=1.0)
for _ in range(20):
    report = simulation.step(advance_mm=4.0)
print(f"{report.inserted_mm[0]:.0f} mm in, push force {report.push_force_n[0]:.4f} N")
