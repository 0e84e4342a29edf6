"""Inject contrast medium and subtract the picture before it: digital subtraction angiography."""

import numpy as np

import endowire

vessel = endowire.Vessel.generate("aortic_arch", edge_mm=3.0)
catheter = endowire.Instrument.read(endowire.assets_path() / "devices" / "catheter_5f_pigtail.toml")
simulation = endowire.Simulation(vessel, catheter, opening=1, method={"name": "kirchhoff", "element_mm": 5.0})
for _ in range(10):
    simulation.step(advance_mm=5.0)

view = {
    "views": ["fluoro"],
    "size_px": [128, 128],
    "frames_per_s": 7.5,
    "c_arm": {"pose": "LAO 40"},
    "xray": {"mode": "dsa"},
    "injection": [{"start_s": 0.2, "duration_s": 1.2, "rate_ml_per_s": 20.0}],
}
renderer = endowire.Renderer(vessel, view)
frames = np.stack([renderer.render(simulation, frame=frame).fluoro for frame in range(15)])

before = frames[0].astype(float)  # the mask: nothing is in yet
for frame in range(0, 15, 2):
    darker = before - frames[frame]
    print(f"{frame / 7.5:.2f} s: {np.count_nonzero(darker > 20)} pixels darker, by {darker.max():.0f} at most")
np.save("angiogram.npy", frames)
