"""Push a wire and the catheter over it, each by its own hand."""

import endowire

devices = endowire.assets_path() / "devices"
wire = endowire.Instrument.read(devices / "wire_035_hydrophilic_angled.toml")
catheter = endowire.Instrument.read(devices / "catheter_4f_vertebral.toml")
simulation = endowire.Simulation(
    endowire.Vessel.generate("aortic_arch", edge_mm=3.0),
    [wire, catheter],  # the innermost first
    opening=1,
    names=["wire", "catheter"],
    friction=[0.05, 0.0],  # between each and the one outside it
    method={"name": "kirchhoff", "element_mm": 5.0},
)
for _ in range(15):
    simulation.step(advance_mm=[6.0, 4.0])  # the wire leads
for _ in range(5):
    report = simulation.step(advance_mm=[0.0, 5.0], rotate_rad=[0.0, 0.1])  # the catheter follows

for k, name in enumerate(["wire", "catheter"]):
    print(
        f"{name}: {report.inserted_mm[k]:.0f} mm in, push {report.push_force_n[k]:.4f} N, "
        f"torque {report.torque_nmm[k]:.4f} N·mm, tip at {simulation.tips_mm[k].round(1)} mm"
    )
