"""Run a scene file: its script, or commands of your own.

python run_a_scene_file.py [SCENE]
"""

import sys

import endowire

file = sys.argv[1] if len(sys.argv) > 1 else endowire.assets_path() / "scenes" / "arch_subclavian.toml"
scene = endowire.Scene(file)

simulation = scene.simulation()
report = scene.run(simulation)  # what its script does
print(f"{scene.name}: {report.inserted_mm[0]:.0f} mm in at the end, push force {report.push_force_n[0]:.4f} N")

mine = scene.simulation()  # the same, with nothing done yet
for _ in range(10):
    mine.step(advance_mm=4.0)
print(f"by commands of your own: {mine.inserted_mm[0]:.0f} mm in, tip at {mine.tip_mm.round(1)} mm")
