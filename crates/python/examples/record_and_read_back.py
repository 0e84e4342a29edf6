"""Record a run, read it back, and plot or tabulate what is in it.

The folder is what `endowire run` writes, too: `endowire report`, `render` and `export` open it.
"""

import endowire

scene = endowire.assets_path() / "scenes" / "arch_subclavian.toml"
simulation = endowire.Scene(scene).simulation()
with endowire.Recorder(simulation, "recorded", scene=scene) as recorder:
    for step in range(50):
        simulation.step(advance_mm=5.0)
        recorder.note(simulation, time_s=0.2 * (step + 1), advance_mm=5.0)

recording = endowire.Recording("recorded")
steps = recording.steps  # an array for each column of steps.csv
print(f"{len(recording)} steps, ended by {recording.summary['ended_by']}")
print(f"largest push force {steps['push_force_n'].max():.4f} N, torque {abs(steps['torque_nmm']).max():.4f} N·mm")
print("centre line at the end:", recording.positions_mm(-1).shape, "mm")
places_mm, forces_n = recording.contacts(-1)
print(len(places_mm), "contacts at the end, wall force", forces_n.sum(axis=0).round(4), "N")
