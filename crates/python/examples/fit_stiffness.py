"""Find the bending stiffness EI of a wire from tips that were observed."""

import numpy as np

import endowire

vessel = endowire.Vessel.generate("curved_tube", edge_mm=2.0)
tip = {"length_mm": 15.0, "radius_mm": 0.2, "bending_stiffness_nmm2": 6.0, "rest_curvature_per_mm": [0.06, 0.0]}
shaft = {"length_mm": 300.0, "radius_mm": 0.2, "bending_stiffness_nmm2": 14.0}
wall = {"modulus_n_per_mm2": 0.02, "friction": 0.1}  # soft: the tip shows what the wire bears
method = {"name": "kirchhoff", "element_mm": 4.0, "tolerance": 1e-8}
start = endowire.Simulation(vessel, endowire.Instrument([tip, shaft]), wall=wall, method=method)
moves = np.full((20, 1, 2), [2.0, 0.05])

# In place of measured tips: those of a wire with another EI, seen to 0.05 mm.
rng, true, observed = np.random.default_rng(0), start.changed({"EI[0]": 8.0}), []
for k, (advance_mm, rotate_rad) in enumerate(moves[:, 0]):
    true.step(advance_mm, rotate_rad)
    if k % 4 == 3:
        seen_mm = true.tip_mm + 0.05 * rng.standard_normal(3)
        observed.append(endowire.Observed(k, "tip", seen_mm, sigma=0.05))

fit = endowire.fit(start, moves, observed, free=["EI[0]"])
print(fit)  # true: 8.0 N·mm²
print("95 % interval:", fit.interval())
