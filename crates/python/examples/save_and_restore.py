"""Save the state of a simulation, try something, and go back; or go on in another process, with the same bits."""

import numpy as np

import endowire

vessel = endowire.Vessel.generate("curved_tube", edge_mm=1.5)
wire = endowire.Instrument.uniform(length_mm=400.0, radius_mm=0.45, bending_stiffness_nmm2=10.0)
simulation = endowire.Simulation(vessel, wire, wall={"friction": 0.1})
for _ in range(30):
    simulation.step(advance_mm=4.0)

simulation.state().save("state.bin")  # all that the next step depends on
tried = simulation.copy()  # for a what-if a copy is enough: it shares the vessel
tried.step(advance_mm=-10.0, rotate_rad=1.0)
print("tried:", tried.tip_mm.round(2), "mm; where it was:", simulation.tip_mm.round(2), "mm")

simulation.step(advance_mm=4.0)
went_on = simulation.tip_mm
# Another simulation of the same vessel, instruments and method, as after a restart.
again = endowire.Simulation(vessel, wire, wall={"friction": 0.1})
again.restore(endowire.State.load("state.bin"))
again.step(advance_mm=4.0)
print("same bits after the restart:", np.array_equal(again.tip_mm, went_on))
