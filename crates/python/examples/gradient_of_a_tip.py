"""How the tip moves with the bending stiffness EI, friction and the hand: derivatives, beside a difference."""

import endowire

vessel = endowire.Vessel.generate("curved_tube", edge_mm=2.0)
tip = {"length_mm": 15.0, "radius_mm": 0.2, "bending_stiffness_nmm2": 6.0, "rest_curvature_per_mm": [0.06, 0.0]}
shaft = {"length_mm": 300.0, "radius_mm": 0.2, "bending_stiffness_nmm2": 14.0}
method = {"name": "kirchhoff", "element_mm": 4.0, "tolerance": 1e-9}  # derivatives are as exact as the equilibrium
simulation = endowire.Simulation(vessel, endowire.Instrument([tip, shaft]), wall={"friction": 0.1}, method=method)
for _ in range(20):
    simulation.step(advance_mm=2.0)

# What a step would lead to, with derivatives. The simulation does not move.
gradient = simulation.gradient(advance_mm=1.5, by=["EI[0]", "friction", "hand"])
for name, column in zip(gradient.by, gradient.of("tip").T):
    print(f"d tip / d {name}: {column.round(4)}")
print("d push force / d EI[0]:", gradient.of("push_force")[0, 0])

# The same by a difference: the wire lies where it lay, and only this step is made with another EI.
ends = []
for change in (-1e-3, 1e-3):
    other = simulation.changed({"EI[0]": 6.0 + change})
    other.step(advance_mm=1.5)
    ends.append(other.tip_mm)
print("by a difference, EI[0]:", ((ends[1] - ends[0]) / 2e-3).round(4))
