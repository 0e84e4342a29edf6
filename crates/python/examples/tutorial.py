# %% [markdown]
# # From a vessel to a policy
#
# A guidewire is pushed into the arch of an aorta, seen by X-rays, tried with different hands at once, and steered by a policy. Run from top to
# bottom this takes a few seconds. It needs `pip install "./crates/python[gym]" matplotlib`.
#
# Lengths are in millimetres, forces in newtons, times in seconds, angles in radians.

# %%
import matplotlib.pyplot as plt
import numpy as np

import endowire

vessel = endowire.Vessel.generate("aortic_arch", edge_mm=3.0)
print(len(vessel.triangles), "triangles,", len(vessel.openings), "openings, targets:", *vessel.targets)

# %% [markdown]
# ## A wire, and a step
# Sections of an instrument come tip first. This one has a soft tip that is bent by 72° about a radius of 12 mm. It begins at the mouth of a sheath, here at
# the vessel's inlet.

# %%
wire = endowire.Instrument(
    [
        {
            "length_mm": 15.0,
            "radius_mm": 0.35,
            "bending_stiffness_nmm2": 1.0,
            "rest_curvature_per_mm": [1 / 12, 0.0],
        },
        {"length_mm": 435.0, "radius_mm": 0.445, "bending_stiffness_nmm2": 12.0},
    ]
)
simulation = endowire.Simulation(
    vessel,
    wire,
    opening=vessel.inlet,
    wall={"friction": 0.1},
    method={"name": "kirchhoff", "element_mm": 5.0},
)
report = simulation.step(advance_mm=5.0)
print("tip at", simulation.tip_mm.round(1), "pushed with", report.push_force_n[0], "N")

# %% [markdown]
# ## What the hand feels
# Every step is an equilibrium, with the force and the torque that hold it. At first the hand holds back a bent tip that the sheath has straightened and that
# springs out of it; then nothing touches, until the wire meets the wall of the arch.

# %%
felt = []
for _ in range(140):
    report = simulation.step(advance_mm=2.0, rotate_rad=0.03)
    felt.append(
        (report.inserted_mm[0], report.push_force_n[0], report.torque_nmm[0], len(report.contact_forces_n))
    )
inserted_mm, push_n, torque_nmm, contacts = np.array(felt).T

figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(6.4, 4.0), layout="constrained")
above.plot(inserted_mm, 1000 * push_n)
above.set(ylabel="push, mN")
below.plot(inserted_mm, torque_nmm, color="tab:orange")
below.set(xlabel="inserted, mm", ylabel="torque, N mm")
plt.show()

# %% [markdown]
# ## What the operator sees
# The wire has found the left subclavian artery. The same moment in space and by X-rays, LAO 40. Labels come with every picture: where the tip is, which pixels the wire covers.

# %%
view = {
    "views": ["3d", "fluoro"],
    "size_px": [384, 384],
    "c_arm": {"primary_deg": 40.0},
    "patient": {"torso": {}},
}
renderer = endowire.Renderer(vessel, view)
frames, labels = renderer.render(simulation), renderer.labels(simulation)
tip_x, tip_y = labels["devices"][0]["tip_px"]

figure, (left, right) = plt.subplots(1, 2, figsize=(8.0, 4.0), layout="constrained")
left.imshow(frames.three_d)
right.imshow(frames.fluoro, cmap="gray")
right.scatter([tip_x], [tip_y], s=120, facecolors="none", edgecolors="tab:orange")
for axes in (left, right):
    axes.set_axis_off()
plt.show()

# %% [markdown]
# ## What if
# A copy shares the vessel and costs microseconds; a state can be kept, pickled and gone back to, to the bit.

# %%
here = simulation.state()
other = simulation.copy()
other.step(advance_mm=4.0, rotate_rad=np.pi / 2)
print(
    "a quarter turn would bring the tip",
    np.linalg.norm(other.tip_mm - simulation.tip_mm).round(2),
    "mm from here",
)
simulation.step(advance_mm=4.0)
simulation.restore(here)

# %% [markdown]
# ## Many hands at once
# A batch steps many simulations of one vessel on all cores, each to the bit as if it were alone. Sixteen hands turn the wire by different angles and push on.

# %%
batch = endowire.Batch([simulation] * 16)
turns_rad = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)
moves = np.zeros((16, 1, 2))
for _ in range(10):
    moves[:, 0] = np.stack([np.full(16, 2.0), turns_rad / 10], axis=1)
    failures = batch.step(moves)
    assert not failures
tips_mm = batch.tip_mm

figure, axes = plt.subplots(figsize=(4.8, 4.0), layout="constrained")
shown = axes.scatter(tips_mm[:, 0], tips_mm[:, 1], c=np.degrees(turns_rad), cmap="twilight")
figure.colorbar(shown, label="turned by, degrees")
axes.set(xlabel="left, mm", ylabel="back, mm", title="where the tip goes, from above")
axes.set_aspect("equal")
plt.show()

# %% [markdown]
# ## An environment, and a policy
# `endowire.gym` registers tasks for Gymnasium. Here a hand of the library follows the centre line to the target, in arches that are drawn from the episodes'
# seeds; any object with `act` takes its place, and so does a model of stable-baselines3 (chapter 16 of the guide trains one).

# %%
from endowire.gym import arches, evaluation, policies, tasks

task = tasks.arch_variety(vessels=arches.ArchVariety(count=None))
for name, policy in (
    ("straight on", policies.Straight()),
    ("follows the path", policies.Steered("follow_path")),
):
    outcomes = evaluation.evaluate(task, policy, seeds=range(4), num_envs=4)
    print(name, "arrives in", sum(outcome.reached for outcome in outcomes), "of", len(outcomes), "arches")
