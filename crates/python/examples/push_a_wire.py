"""Push a wire into a built-in anatomy and print the forces."""

import endowire

vessel = endowire.Vessel.generate("aortic_arch", edge_mm=3.0)
tip = {"length_mm": 25.0, "radius_mm": 0.445, "bending_stiffness_nmm2": 4.0, "rest_curvature_per_mm": [0.06, 0.0]}
shaft = {"length_mm": 600.0, "radius_mm": 0.445, "bending_stiffness_nmm2": 20.0}
wire = endowire.Instrument([tip, shaft])  # from the tip to the hand
simulation = endowire.Simulation(vessel, wire, wall={"friction": 0.05})

for step in range(65):
    report = simulation.step(advance_mm=4.0, rotate_rad=0.05)
    if step % 13 == 12:
        wall_n = report.contact_normal_forces_n.sum()
        print(
            f"{report.inserted_mm[0]:4.0f} mm in: push {report.push_force_n[0] * 1e3:.2f} mN, "
            f"torque {report.torque_nmm[0]:.4f} N·mm, wall {wall_n * 1e3:.2f} mN at {len(report.contact_forces_n)} contacts"
        )
print("tip at", simulation.tip_mm.round(1), "mm")
