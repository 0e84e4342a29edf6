"""Let a vessel move with the breath while the hand rests: the wire goes along, and its forces change."""

import endowire

SCENE = """
[vessel]
file = "vessels/curved_tube.stl"
[vessel.wall]
friction = 0.05
[[vessel.motion]]
waveform = "breathing"
period_s = 4.0
displacement_mm = [0.0, 3.0, 8.0]
still = { centre_mm = [0.0, 0.0, 0.0], radius_mm = 20.0, fade_mm = 90.0 }
[device]
file = "devices/wire_035_soft.toml"
[sheath]
position_mm = [0.0, 0.0, 1.0]
direction = [0.0, 0.0, 1.0]
"""
# A scene may be text: its files are looked for beside the path that it is given.
simulation = endowire.Scene(endowire.assets_path() / "breathing.toml", text=SCENE).simulation()
for _ in range(35):
    simulation.step(advance_mm=4.0, time_s=0.0)  # nothing moves yet but the hand
for tenth in range(5, 45, 5):
    report = simulation.step(time_s=0.1 * tenth)  # hands at rest
    print(f"{simulation.time_s:.1f} s: tip at {simulation.tip_mm.round(1)} mm, push {1e3 * report.push_force_n[0]:.2f} mN")
