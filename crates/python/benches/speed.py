"""What environments and the package cost, in processor time.

RAYON_NUM_THREADS=1 python crates/python/benches/speed.py                 # all but `random`
RAYON_NUM_THREADS=1 python crates/python/benches/speed.py calls resets    # some of it
RAYON_NUM_THREADS=1 python crates/python/benches/speed.py random --steps 1000000
RAYON_NUM_THREADS=1 python crates/python/benches/speed.py environments pushes --solves 30    # steps of a fixed cost
RAYON_NUM_THREADS=1 python crates/python/benches/speed.py ticks --steps 20000 --solves 8
"""

import argparse
import collections
import resource
import subprocess
import sys
import time

import gymnasium
import numpy as np

import endowire
import endowire.gym
from endowire.gym import arches, observations


def processor_s(work, times=1):
    """Processor time of one of so many."""
    began = time.process_time()
    for _ in range(times):
        work()
    return (time.process_time() - began) / times


def resident_kib():
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * resource.getpagesize() // 1024


# Slowest speed of pushing of random steps, over the fastest: they go in on the whole.
BACK = -2.0 / 7.0


def random_steps(environments, steps, seed=0):
    """Steps with random velocities, as a policy that has learnt nothing makes them; reasons for which episodes ended."""
    rng, high = np.random.default_rng(seed), environments.action_space.high
    low = -high
    low[..., ::2] = BACK
    ended = collections.Counter()
    for _ in range(-(-steps // environments.num_envs)):
        *_, terminated, truncated, info = environments.step(rng.uniform(low, high))
        for k in np.flatnonzero(terminated | truncated):
            left = environments.unwrapped.episodes.batch.left_through[k] >= 0
            reason = info["failure"][k].split(":")[0] or ("left the vessel" if left else "step limit")
            ended["reached" if info["reached"][k] else reason] += 1
    return ended


def environments(n, steps, solves):
    """Environment steps a second, episodes' beginnings included."""
    picture = {"fluoroscopy": observations.Fluoroscopy(size_px=(128, 128))}
    for name, task, parts in (
        (
            "ArchVariety, a new arch in each episode",
            "ArchVariety",
            {"vessels": arches.ArchVariety(count=None)},
        ),
        ("ArchVariety, four arches kept", "ArchVariety", {"vessels": arches.ArchVariety(count=4)}),
        (
            "    with a picture of 128 × 128",
            "ArchVariety",
            {"vessels": arches.ArchVariety(count=4), "observations": picture},
        ),
        ("DualDeviceNav in the built-in arch", "DualDeviceNav", {}),
    ):
        made = gymnasium.make_vec(f"endowire/{task}-v0", num_envs=n, solves=solves, **parts)
        made.reset(seed=0)
        ended = {}
        spent = processor_s(lambda: ended.update(random_steps(made, steps)))
        print(f"{name:42}{steps / spent:8.0f} steps/s   ({sum(ended.values())} episodes ended: {ended})")


def pushes(n, steps, solves):
    """How long single steps take where the wire is pushed as fast as it may be, whatever comes of it, and how far it is behind the hand."""
    made = gymnasium.make_vec(
        "endowire/ArchVariety-v0", num_envs=1, solves=solves, vessels=arches.ArchVariety(count=None)
    )
    made.reset(seed=0)
    push = np.zeros_like(made.action_space.high)
    push[..., ::2] = made.action_space.high[..., ::2]
    took_ms, behind_mm = np.empty(steps), np.empty(steps)
    for k in range(steps):
        began = time.perf_counter()
        *_, info = made.step(push)
        took_ms[k], behind_mm[k] = 1e3 * (time.perf_counter() - began), info["behind_mm"][0]
    for name, values in (("a push, ms", took_ms), ("behind the hand, mm", behind_mm)):
        parts = np.quantile(values, [0.5, 0.9, 0.99, 0.999, 1.0])
        print(f"{name:42}" + "".join(f"{part:9.2f}" for part in parts) + "   (50, 90, 99, 99.9, 100 %)")
    print(f"{'pushes a second':42}{1e3 * steps / took_ms.sum():9.0f}")


def two_instruments(vessel, inserted_mm, **where):
    """A bent wire in a bent catheter, so far into a vessel, with friction on the wall and on each other."""
    bent = {"length_mm": 15.0, "rest_curvature_per_mm": [0.06, 0.0]}

    def device(length_mm, keys):
        return endowire.Instrument([{**bent, **keys}, {"length_mm": length_mm - 15.0, **keys}])

    wire = device(600.0, {"radius_mm": 0.3, "bending_stiffness_nmm2": 5.0})
    catheter = device(500.0, {"radius_mm": 0.6, "bending_stiffness_nmm2": 15.0, "inner_radius_mm": 0.35})
    method = {"name": "kirchhoff", "element_mm": 5.0, "tolerance": 1e-4}
    both = endowire.Simulation(
        vessel, [wire, catheter], wall={"friction": 0.1}, method=method, friction=[0.1, 0.0], **where
    )
    for _ in range(100):
        both.step([mm / 100.0 for mm in inserted_mm])
    return both


def ticks(n, steps, solves):
    """Two instruments at 1 kHz in the arch and, with --surface, in another vessel: hands go to and fro and turn, with new speeds every 60 ms, and rest for 20 ms
    before that; how long ticks take, how far hands are ahead, and how far tips at rest are from where they come to with hands held still."""
    cases = [("arch", two_instruments(endowire.Vessel.generate("aortic_arch"), (260.0, 230.0)))]
    if args.surface:
        vessel = endowire.Vessel.read(args.surface)
        cases.append((args.surface, two_instruments(vessel, (40.0, 25.0), opening=args.opening)))
    for name, both in cases:
        rng = np.random.default_rng(1)
        took_ms, behind_mm, off_mm = np.empty(steps), np.zeros(steps), []
        for k in range(steps):
            if k % 80 == 0:
                speeds = rng.uniform(-1.0, 1.0, (2, 2)) * [0.03, 0.004]
            advance_mm, rotate_rad = np.zeros((2, 2)) if k % 80 >= 60 else speeds.T
            began = time.thread_time()
            report = both.tick(advance_mm, rotate_rad, solves=solves or 8)
            took_ms[k] = 1e3 * (time.thread_time() - began)
            if report.behind is not None:
                behind_mm[k] = np.abs(report.behind[:, 0]).max()
            if k % 80 == 79:
                rests = both.copy()
                rests.step([0.0, 0.0])
                off_mm.append(np.linalg.norm(both.tips_mm - rests.tips_mm, axis=1).max())
        print(f"{name}: {steps} ticks of {solves or 8} solves")
        for what, values in (("a tick, ms", took_ms), ("behind the hands, mm", behind_mm), ("tips at rest off by, mm", off_mm)):
            parts = np.quantile(values, [0.5, 0.9, 0.99, 0.999, 1.0])
            print(f"{what:42}" + "".join(f"{part:9.3f}" for part in parts) + "   (50, 90, 99, 99.9, 100 %)")


def resets(n, steps, solves):
    """What a new arch and its simulation take."""
    variety, rng = arches.ArchVariety(count=None), np.random.default_rng(0)
    task = gymnasium.make("endowire/ArchVariety-v0").unwrapped.task
    sites = []
    made = processor_s(lambda: sites.append(variety.sample(rng)), 20)
    begun = processor_s(lambda: task.start(sites.pop()), 20)
    print(f"{'a new arch':42}{1e3 * made:8.1f} ms")
    print(f"{'its simulation':42}{1e3 * begun:8.1f} ms")
    kept = gymnasium.make("endowire/ArchVariety-v0", vessels=arches.ArchVariety(count=1))
    kept.reset(seed=0)
    print(f"{'an episode in an arch that is kept':42}{1e3 * processor_s(kept.reset, 100):8.2f} ms")


def calls(n, steps, solves):
    """What Python adds to a step."""
    made = gymnasium.make_vec("endowire/ArchVariety-v0", num_envs=n, vessels=arches.ArchVariety(count=4))
    made.reset(seed=0)
    for _ in range(15):
        made.step(np.tile([[0.9, 0.2]], (n, 1, 1)))
    still, batch = np.zeros((n, 1, 2)), made.unwrapped.episodes.batch
    for name, work in (
        ("Batch.step that moves nothing", lambda: batch.step(still)),
        ("tips, forces, lengths", lambda: (batch.tip_mm, batch.push_force_n, batch.inserted_mm)),
        ("a step of the environment, that included", lambda: made.step(still)),
    ):
        work()
        print(f"{name:42}{1e6 * processor_s(work, 500) / n:8.2f} µs a simulation of {n}")
    simulation = batch.simulation(0)
    print(f"{'Simulation.step that moves nothing':42}{1e6 * processor_s(simulation.step, 10000):8.2f} µs")
    before, copies = resident_kib(), [simulation.copy() for _ in range(100)]
    for copy in copies:
        copy.step(1.0)
    print(f"{'memory of a copy that steps':42}{(resident_kib() - before) / len(copies):8.0f} KiB")


def threads(n, steps, solves):
    """Wall time of the same steps on one thread and on two; of use on an idle machine alone."""
    code = (
        "import sys, time; sys.path.insert(0, sys.argv[1]); import gymnasium, speed; from endowire.gym import arches\n"
        f"made = gymnasium.make_vec('endowire/ArchVariety-v0', num_envs={n}, vessels=arches.ArchVariety(count=4))\n"
        f"made.reset(seed=0); t = time.perf_counter(); speed.random_steps(made, {steps}); print(time.perf_counter() - t)"
    )
    one, two = (
        float(
            subprocess.check_output(
                ["env", f"RAYON_NUM_THREADS={count}", sys.executable, "-c", code, sys.path[0]]
            )
        )
        for count in (1, 2)
    )
    print(f"{'two threads, times as fast as one':42}{one / two:8.2f}")


def random(n, steps, solves):
    """Many steps with random actions: why episodes end, and whether memory grows."""
    made = gymnasium.make_vec("endowire/ArchVariety-v0", num_envs=n, vessels=arches.ArchVariety(count=4))
    made.reset(seed=0)
    ended = collections.Counter()
    for part in range(10):
        began = time.process_time()
        ended += random_steps(made, steps // 10, seed=part)
        rate = steps / 10 / (time.process_time() - began)
        print(
            f"{(part + 1) * steps // 10:10} steps  {resident_kib():8} KiB  {rate:6.0f} steps/s  {dict(ended)}",
            flush=True,
        )


PARTS = {
    "environments": environments,
    "pushes": pushes,
    "ticks": ticks,
    "resets": resets,
    "calls": calls,
    "threads": threads,
    "random": random,
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", default=["environments", "resets", "calls", "threads"])
    parser.add_argument("--simulations", type=int, default=64)
    parser.add_argument("--steps", type=int, default=20_000)
    parser.add_argument("--solves", type=int, help="linear solves of a step (of environments, pushes and ticks)")
    parser.add_argument("--surface", help="a vessel beside the arch, for ticks")
    parser.add_argument("--opening", type=int, default=0, help="where it is entered")
    args = parser.parse_args()
    for one in args.parts:
        PARTS[one](args.simulations, args.steps, args.solves)
