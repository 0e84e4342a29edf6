"""How soon plans are found, against the controller that searches ahead, and what gradients would add.

    RAYON_NUM_THREADS=1 python crates/python/benches/plans.py compare                # sixteen arches, some minutes
    RAYON_NUM_THREADS=1 python crates/python/benches/plans.py gradients              # turns at places where a push came no farther

Arches are those of evaluation (`endowire/ArchVariety-v0`, seeds 900000 and on), ways those to their targets. Times are processor time of
one thread.
"""

import argparse
import time

import numpy as np

import endowire
from endowire.gym import arches, environment, tasks
from endowire.planning import Planner

FIRST = 900_000
TURNS_RAD = np.pi / 3 * np.arange(6)


def places(seeds):
    """Simulations with nothing inserted, and the way to the target of each."""
    env = environment.InsertionEnv(tasks.arch_variety(vessels=arches.ArchVariety(count=None)))
    for seed in seeds:
        env.reset(seed=FIRST + seed)
        yield seed, env.simulation, env.episodes.paths[0].table_mm


def drive(controller, simulation, most_s):
    """Whether a controller arrives, the commands that it takes and its time."""
    began, commands = time.process_time(), 0
    while time.process_time() - began < most_s and (move := controller.next(simulation)) is not None:
        try:
            simulation.step(*move.T)
        except endowire.EndOfWay:
            # Where the way ends an instrument stays.
            pass
        commands += 1
    return controller.ended == "arrived", commands, time.process_time() - began


def compare(seeds, most_s):
    both, found_s = [], []
    for seed, simulation, path_mm in places(seeds):
        began = time.process_time()
        endowire.plan(simulation, path_mm)
        found_s.append(time.process_time() - began)
        told = [drive(of(path_mm), simulation.copy(), most_s) for of in (Planner, endowire.Controller.search_ahead)]
        rows = [f"{'arrived' if there else 'lost':8}{n:5} commands {s:7.2f} s" for there, n, s in told]
        print(seed, f"found in {found_s[-1]:.2f} s", *rows, sep="   ", flush=True)
        both.append(told)
    for name, rows in zip(("plan", "search_ahead"), zip(*both, strict=True), strict=True):
        there = [row for row in rows if row[0]]
        commands = f", {np.median([n for _, n, _ in there]):.0f} commands (median)" if there else ""
        print(f"{name}: {len(there)} of {len(rows)}{commands}")
    shared = [(alone_s, *told) for alone_s, told in zip(found_s, both, strict=True) if all(there for there, *_ in told)]
    if not shared:
        return
    for name, times_s in (("found", [one[0] for one in shared]), ("found and carried out", [one[1][2] for one in shared])):
        ratios = [one[2][2] / time_s for one, time_s in zip(shared, times_s, strict=True)]
        print(f"where both arrive, {len(shared)}: {name} in {sum(times_s):.1f} s, 1/{np.median(ratios):.1f} of the time of search_ahead (median)")
    print(f"search_ahead there: {sum(one[2][2] for one in shared):.1f} s")


def gradients(seeds):
    """Of the trials of a plan at the first place where a push comes no farther: how many have a derivative by the turn, what a step of
    0.3 rad along it adds to the best place that they come to, and what it costs."""
    counts, costs = {"trials": 0, "with a derivative": 0, "1 mm farther by a step": 0}, []
    for _, simulation, path_mm in places(seeds):
        planner, states = Planner(path_mm), [simulation.copy()]

        def worth_mm(place_mm, planner=planner):
            arc_mm, off_mm, radius_mm = planner.on_path(place_mm)
            return arc_mm - 2.0 * max(0.0, off_mm - radius_mm)

        while worth_mm(states[-1].tip_mm) > max([worth_mm(one.tip_mm) for one in states[:-1][-3:]], default=-np.inf) - 1e-9:
            states.append(states[-1].copy())
            states[-1].step(4.0)
        base = states[-4] if len(states) > 4 else states[0]
        for turn_rad in TURNS_RAD:
            moves = np.array([[[0.0, turn_rad]], *[[[4.0, 0.0]]] * 7])
            counts["trials"] += 1
            try:
                began = time.process_time()
                plain_mm = best_mm(base, moves, worth_mm)
                took_s = time.process_time() - began
                began = time.process_time()
                found = base.gradients(moves, by=["rotate"])
            except endowire.EndowireError:
                continue
            costs.append((time.process_time() - began) / took_s)
            counts["with a derivative"] += 1
            best = max(found, key=lambda one: worth_mm(one.positions_mm[-1]))
            tip_mm, slope = best.positions_mm[-1], best.of("tip")[:, 0]
            moves[0, 0, 1] += 0.3 * np.sign(worth_mm(tip_mm + 1e-3 * slope) - worth_mm(tip_mm - 1e-3 * slope))
            try:
                counts["1 mm farther by a step"] += best_mm(base, moves, worth_mm) > plain_mm + 1.0
            except endowire.EndowireError:
                pass
    print(counts, f"cost of a derivative {np.median(costs):.1f} trials (median)" if costs else "")


def best_mm(base, moves, worth_mm):
    simulation, worths = base.copy(), []
    for move in moves:
        simulation.step(*move[0])
        worths.append(worth_mm(simulation.tip_mm))
    return max(worths)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["compare", "gradients"])
    parser.add_argument("--seeds", type=int, nargs="*", default=range(16), help=f"beyond {FIRST}")
    parser.add_argument("--most-s", type=float, default=40.0, help="processor time of a run, s; inf for none")
    args = parser.parse_args()
    if args.what == "compare":
        compare(args.seeds, args.most_s)
    else:
        gradients(args.seeds)


if __name__ == "__main__":
    main()
