"""Plan the commands that bring a hooked wire into a branch, and carry them out."""

import endowire

vessel = endowire.Vessel.generate("aortic_arch", edge_mm=3.0)
print("targets:", ", ".join(vessel.targets))
hook = {"length_mm": 15.0, "radius_mm": 0.35, "bending_stiffness_nmm2": 1.0, "rest_curvature_per_mm": [0.08, 0.0]}
shaft = {"length_mm": 400.0, "radius_mm": 0.45, "bending_stiffness_nmm2": 12.0}
simulation = endowire.Simulation(
    vessel,
    endowire.Instrument([hook, shaft]),
    wall={"friction": 0.1},
    method={"name": "kirchhoff", "element_mm": 5.0},
)
plan = endowire.plan(simulation, vessel.path("left subclavian"), arrived_mm=5.0)
print(f"reached: {plan.reached}, {len(plan.moves)} commands, {plan.trials} turns tried, {plan.left_mm:.1f} mm left")

simulation.run(plan.moves)  # the plan was made on copies
print("tip at", simulation.tip_mm.round(1), "mm, planned", plan.tips_mm[-1].round(1), "mm")
