"""Step many simulations at once on all cores. Each gives the bits that it would give alone."""

import numpy as np

import endowire

vessel = endowire.Vessel.generate("aortic_arch", edge_mm=3.0)
wire = endowire.Instrument.read(endowire.assets_path() / "devices" / "wire_035_hooked.toml")
start = endowire.Simulation(vessel, wire, opening=1, method={"name": "kirchhoff", "element_mm": 5.0})
turns_rad = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
batch = endowire.Batch([start] * len(turns_rad))  # they share the vessel

moves = np.zeros((len(batch), 1, 2))  # advance_mm and rotate_rad of each instrument of each
moves[:, 0, 1] = turns_rad
batch.step(moves)
moves[:, 0] = [5.0, 0.0]
for _ in range(50):
    for index, error in batch.step(moves).items():  # the others have gone on
        print(f"turned by {turns_rad[index]:.2f} rad: {error}")
for turn, tip, force in zip(turns_rad, batch.tip_mm, batch.largest_contact_force_n):
    print(f"turned by {turn:.2f} rad: tip at {tip.round(1)} mm, {1e3 * force:.2f} mN at the hardest contact")
