"""Shapes the tip of a catheter to the angle of a branch: inverse design with gradients.

    python crates/python/examples/shape_tip.py 40 60 80        # angles between the trunk and the branch, degrees

The tip of a catheter in a trunk shall be in the middle of a branch's mouth and point into it. Free are the rest curvatures of two sections
at the tip; where the wire lies for them is computed in equilibrium with the wall. `endowire.fit` finds them: what is wanted takes the place
of what was observed. Then the shaped catheter is pushed, and is in the branch, where a straight one passes by.
"""

import argparse

import numpy as np

import endowire

#: Radii of trunk and branch, where the branch begins on the axis of the trunk, and its length, mm.
TRUNK_MM, BRANCH_MM, FORK_MM, LONG_MM = 8.0, 3.5, 70.0, 50.0
#: Sections from the tip, mm, and their radius and stiffness: a soft 4F catheter.
SECTIONS_MM, RADIUS_MM, STIFFNESS_NMM2 = (10.0, 10.0, 180.0), 0.67, (8.0, 8.0, 25.0)
#: How exactly a place is wanted, mm.
WITHIN_MM = 0.5
#: How deep in the branch its tip is wanted, mm.
DEEP_MM = 6.0


def vessel(angle_deg):
    """A straight trunk with a branch at an angle, and the direction of the branch."""
    angle = np.deg2rad(angle_deg)
    direction = np.array([np.sin(angle), 0.0, np.cos(angle)])
    trunk = [[0.0, 0.0, z, TRUNK_MM] for z in np.arange(0.0, 131.0, 10.0)]
    fork = int(FORK_MM / 10.0)
    begins_mm = TRUNK_MM / np.sin(angle)
    at = np.linspace(begins_mm, begins_mm + LONG_MM, 6)
    branch = [[*(direction * mm + [0.0, 0.0, FORK_MM]), BRANCH_MM] for mm in at]
    parents = [*range(-1, len(trunk) - 1), fork, *range(len(trunk), len(trunk) + len(branch) - 1)]
    return endowire.Vessel.generate(np.column_stack([trunk + branch, parents]), edge_mm=1.5), direction


def catheter(curvatures_per_mm):
    """A catheter whose sections at the tip have these rest curvatures."""
    rest = [*curvatures_per_mm, 0.0]
    sections = zip(SECTIONS_MM, STIFFNESS_NMM2, rest, strict=True)
    keys = ("length_mm", "bending_stiffness_nmm2", "rest_curvature_per_mm")
    return endowire.Instrument([{"radius_mm": RADIUS_MM, **dict(zip(keys, (mm, ei, [u, 0.0]), strict=True))} for mm, ei, u in sections])


def inserted(walls, curvatures_per_mm):
    """The catheter at the opening of the trunk; its first bend points to the branch."""
    method = {"name": "kirchhoff", "element_mm": 2.5, "tolerance": 1e-8}
    sheath = {"position_mm": [0.0, 0.0, 2.0], "direction": [0.0, 0.0, 1.0], "bends_towards": [1.0, 0.0, 0.0]}
    return endowire.Simulation(walls, catheter(curvatures_per_mm), method=method, **sheath)


def mouth(angle_deg):
    """The middle of the branch's mouth, mm, and how far it is from the fork."""
    from_fork_mm = TRUNK_MM / np.sin(np.deg2rad(angle_deg))
    return np.array([0.0, 0.0, FORK_MM]) + from_fork_mm * vessel(angle_deg)[1], from_fork_mm


def moves(angle_deg):
    """Pushes: as long as the way along the axis of the trunk to the fork, and from there into the branch."""
    length_mm = FORK_MM - 2.0 + mouth(angle_deg)[1] + DEEP_MM
    return np.tile([2.0, 0.0], (round(length_mm / 2.0), 1, 1))


def wanted(angle_deg):
    """Where the tip shall be after them, in the branch, and the place that far behind it, in its mouth."""
    mouth_mm, direction = mouth(angle_deg)[0], vessel(angle_deg)[1]
    places_mm = np.concatenate([mouth_mm + DEEP_MM * direction, mouth_mm])
    return endowire.Observed(len(moves(angle_deg)) - 1, "points", places_mm, WITHIN_MM, from_tip_mm=[0.0, DEEP_MM])


def shape(angle_deg):
    """The fit of the curvatures of the tip to the branch, and the vessel."""
    walls, _ = vessel(angle_deg)
    start = inserted(walls, [0.01, 0.01])
    return endowire.fit(start, moves(angle_deg), [wanted(angle_deg)], ["rest_u[0]", "rest_u[1]"]), walls


def way_in_mm(angle_deg, walls, curvatures_per_mm):
    """How far along the branch, from its beginning on the axis of the trunk, a catheter comes that is pushed on, mm; 0 beside it."""
    simulation, (_, direction) = inserted(walls, curvatures_per_mm), vessel(angle_deg)
    fork_mm, farthest_mm = np.array([0.0, 0.0, FORK_MM]), 0.0
    for _ in range(60):
        try:
            simulation.step(2.0)
        except endowire.EndOfWay:
            break
        along_mm = (simulation.tip_mm - fork_mm) @ direction
        if np.linalg.norm(simulation.tip_mm - fork_mm - along_mm * direction) < BRANCH_MM:
            farthest_mm = max(farthest_mm, along_mm)
    return farthest_mm


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("angles", type=float, nargs="*", default=[40.0, 60.0, 80.0], help="degrees")
    for angle_deg in parser.parse_args().angles:
        found, walls = shape(angle_deg)
        bends_deg = np.rad2deg(found.values * SECTIONS_MM[:2])
        straight_mm, shaped_mm = (way_in_mm(angle_deg, walls, of) for of in ([0.0, 0.0], found.values))
        print(
            f"branch at {angle_deg:.0f}°: bends of {bends_deg[0]:.0f}° and {bends_deg[1]:.0f}° in {found.iterations} iterations, "
            f"off by {WITHIN_MM * np.sqrt(found.chi2 / 2.0):.1f} mm; comes {shaped_mm:.0f} mm along the branch, straight {straight_mm:.0f} mm"
        )


if __name__ == "__main__":
    main()
