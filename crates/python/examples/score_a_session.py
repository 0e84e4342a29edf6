"""Score a training session: measures of a recorded procedure, and what a subject asks for.

`endowire play left_carotid` records a session by hand (`played.session.json`); here a program is the trainee.
"""

import endowire

assets = endowire.assets_path()
file = assets / "scenes" / "arch_carotid.toml"
scene = endowire.Scene(file)
simulation, time_s = scene.simulation(), 0.0
with endowire.Recorder(simulation, "session", scene=file) as recorder:
    for ((advance_mm, rotate_rad),) in scene.moves:  # one instrument
        simulation.step(advance_mm, rotate_rad)
        time_s += 0.1 + abs(advance_mm) / 10.0 + abs(rotate_rad)  # 10 mm/s, 1 rad/s
        recorder.note(simulation, time_s, advance_mm, rotate_rad)

measures = {measure["name"]: measure for measure in endowire.assess("session")}
for name in ("total_s", "tip_path_mm", "wall_force_n", "push_speed_mm_per_s", "jumps"):
    print(f"{name}: {measures[name]['value']:.4g} {measures[name]['unit']} ({measures[name]['better']} is better)")

score = endowire.score("session", assets / "subjects" / "left_carotid.toml")
print(f"ended by {score['ended']['by']}, score {score['score']:.0f} ({score['band']}), passed: {score['passed']}")
for thing in score["unjudged"]:  # a program looks at no picture: there is no beam to judge
    print("not judged:", thing["what"])
