"""What the package costs beside the simulation: `python crates/python/benches/speed.py [number of simulations]`."""

import resource
import sys
import time

import gymnasium
import numpy as np

import endowire
import endowire.gym


def seconds(work, times):
    work()
    began = time.perf_counter()
    for _ in range(times):
        work()
    return (time.perf_counter() - began) / times


def resident_kib():
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * resource.getpagesize() // 1024


def main(n):
    environments = gymnasium.make_vec("endowire/AorticArch-v0", num_envs=n)
    environments.reset(seed=0)
    rng = np.random.default_rng(0)
    limits = environments.single_action_space.high
    actions = [rng.uniform([-10.0, -3.14], limits, (n, 1, 2)) for _ in range(100)]
    began = time.perf_counter()
    for action in actions:
        environments.step(action)
    print(f"environment steps on all cores  {len(actions) * n / (time.perf_counter() - began):8.0f} /s")

    simulation = environments.unwrapped._episodes.batch.simulation(0)
    batch, still = endowire.Batch([simulation] * n), np.zeros((n, 1, 2))
    call = seconds(lambda: batch.step(still), 1000)
    print(f"Batch.step that moves nothing   {1e6 * call / n:8.2f} µs a simulation of {n}")
    read = seconds(lambda: (batch.tip_mm, batch.push_force_n, batch.inserted_mm), 1000)
    print(f"tips, forces, lengths           {1e6 * read / n:8.2f} µs a simulation of {n}")
    print(f"Simulation.step, nothing moved  {1e6 * seconds(simulation.step, 10000):8.2f} µs")

    before, copies = resident_kib(), [simulation.copy() for _ in range(100)]
    for copy in copies:
        copy.step(1.0)
    print(f"memory of a copy that steps     {(resident_kib() - before) / len(copies):8.0f} KiB")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 64)
