"""Push a stiff wire into a winding artery that yields to it, beside one that does not."""

import endowire

vessel = endowire.Vessel.generate("aorto_iliac", edge_mm=3.0)
wire = endowire.Instrument.read(endowire.assets_path() / "devices" / "wire_035_lunderquist.toml")
groin = {"position_mm": [0.0, 0.0, 0.0], "direction": [0.41, 0.235, 0.88]}
wall = {"modulus_n_per_mm2": 0.5, "friction": 0.05}
for name, yielding in [("yields", {"preset": "iliac"}), ("does not", None)]:
    simulation = endowire.Simulation(vessel, wire, wall=wall, yielding=yielding, **groin)
    for _ in range(12):
        report = simulation.step(advance_mm=10.0)
    print(
        f"{name}: push force {report.push_force_n[0]:.2f} N, {report.bend_energy_mj:.1f} mJ in the wire's bends, "
        f"{report.vessel_energy_mj:.1f} mJ in the vessel's course, {report.max_penetration_mm:.2f} mm into the wall"
    )
# Where the named places of the vessel that yields are now: simulation.places_mm.
