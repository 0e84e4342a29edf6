"""Draw a fluoroscopic picture with its label map: which pixels show the wire, where its tip is."""

import numpy as np

import endowire

vessel = endowire.Vessel.generate("aortic_arch", edge_mm=3.0)
wire = endowire.Instrument.read(endowire.assets_path() / "devices" / "wire_035_hooked.toml")
simulation = endowire.Simulation(vessel, wire, opening=1)
for _ in range(30):
    simulation.step(advance_mm=5.0)

view = {"views": ["fluoro"], "size_px": [192, 192], "c_arm": {"pose": "LAO 40"}, "patient": {"torso": {}}}
renderer = endowire.Renderer(vessel, view)
picture = renderer.render(simulation).fluoro  # shape (height, width), 8 bits
labels = renderer.labels(simulation)

mask = labels["mask"]  # 0, and k + 1 where instrument k is
device = labels["devices"][0]
print("picture", picture.shape, "wire in", np.count_nonzero(mask == 1), "pixels")
print("tip at pixel", np.round(device["tip_px"], 1), "visible" if device["tip_visible"] else "not visible")
print("centre line of", len(device["centre_line_px"]), "points,", len(labels["contacts"]), "contacts")
np.savez("picture.npz", picture=picture, mask=mask)
