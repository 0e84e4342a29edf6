"""Learns to steer a wire into the branches of aortic arches that it has never seen: ArchVariety with stable-baselines3.

    python crates/python/examples/learn_arch.py train out/learn          # begins, or goes on where it was stopped
    python crates/python/examples/learn_arch.py evaluate out/learn       # what has been learnt, and what does not learn, on unseen arches
    python crates/python/examples/learn_arch.py plot out/learn           # the curve
    python crates/python/examples/learn_arch.py evaluate out/ceiling --policies look-ahead plan --most-s inf    # hours: what can be reached

Of several folders, `out/learn-1 out/learn-2 …`, each is learnt in its turn from a seed of its own, and `evaluate` and `plot` cover all of them.

What is learnt: SAC, whose memory begins with episodes of a hand of the library that follows the centre line and with random ones. The policy sees a
roadmap of the way ahead from the tip, and its last action; nothing of the wall. Each episode is in a new arch. Rewards of learning are its own;
evaluation is the task's own in all but what is observed: `--task strict`, where an episode is lost when the tip leaves the vessel, or
`--task as-evaluated`, where it is not, as its authors evaluate it. `learnt` draws its actions as in learning, `learnt-mean` takes their mean.
"""

import argparse
import csv
import time
from collections import deque
from pathlib import Path

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecNormalize

from endowire.gym import arches, ends, evaluation, observations, policies, rewards, tasks
from endowire.gym.sb3 import Learned, SB3VecEnv

#: Episodes of evaluation, each in the arch of its seed; arches that are learnt on come from the seed of learning.
EVALUATED = range(900_000, 901_000)
ENVIRONMENTS = 16
#: Steps of each environment with which the memory begins: of the hand, and random ones.
FIRST = {"follow": 150, "random": 60}
SEEN = {"roadmap": observations.Roadmap(), "last_action": observations.LastAction()}
EVALUATION = (
    "task",
    "policy",
    "seed",
    "reached",
    "steps",
    "way_mm",
    "safety",
    "failure",
    "path_length_mm",
    "largest_wall_force_n",
    "largest_tip_force_n",
    "safe_success",
    "wall_time_s",
    "out_of_time",
    "processor_s",
)
#: A row every so many steps: shares and means are of the last hundred episodes.
CURVE, EVERY = ("steps", "processor_s", "reached", "return"), 1024


def learning_task():
    """A new arch in each episode, five times the reward for the way against that at its end, and an end where steps take seconds."""
    left = ends.LeftVessel()
    # It leads nowhere: the learner shall not guess what would come after it.
    left.terminates = True
    return tasks.arch_variety(
        vessels=arches.ArchVariety(count=None),
        observations=SEEN,
        rewards=[rewards.Reached(2.0), rewards.EachStep(-0.01), rewards.Approach(0.01)],
        ends=[ends.TargetReached(), left, ends.Laborious(), ends.StepLimit(250)],
    )


#: The task by what loses an episode.
TASKS = {"strict": tasks.arch_variety, "as-evaluated": tasks.arch_variety_as_evaluated}


def unseen_task(kind="strict"):
    """The task with a new arch in each episode."""
    return TASKS[kind](vessels=arches.ArchVariety(count=None), observations=SEEN)


def remember(model, normalize, policy, steps):
    """Puts so many steps of a policy into the memory."""
    environments = normalize.venv
    limits, observed = environments.task.limits(), environments.reset()
    for _ in range(steps):
        action = np.clip(policy.act(environments.episodes) / limits, -1.0, 1.0)
        following, reward, over, infos = environments.step(action)
        last = {name: values.copy() for name, values in following.items()}
        for k in np.flatnonzero(over):
            for name, values in infos[k]["terminal_observation"].items():
                last[name][k] = values
        model.replay_buffer.add(observed, last, action, reward, over, infos)
        for name, values in following.items():
            normalize.obs_rms[name].update(values)
        observed = following


class Watch(BaseCallback):
    """Writes the curve and checkpoints, and stops in time."""

    def __init__(self, out, normalize, processor_s, before_s):
        super().__init__()
        self.out, self.normalize = out, normalize
        self.processor_s, self.before_s = processor_s, before_s
        self.ended, self.returns, self.running = deque(maxlen=100), deque(maxlen=100), np.zeros(ENVIRONMENTS)

    def spent_s(self):
        return self.before_s + time.process_time()

    def _on_step(self):
        self.running += self.locals["rewards"]
        for k in np.flatnonzero(self.locals["dones"]):
            self.ended.append(bool(self.locals["infos"][k]["reached"]))
            self.returns.append(self.running[k])
            self.running[k] = 0.0
        if self.num_timesteps % EVERY < ENVIRONMENTS:
            mean = [np.mean(values) if values else "" for values in (self.ended, self.returns)]
            with (self.out / "curve.csv").open("a", newline="") as file:
                csv.writer(file).writerow((self.num_timesteps, round(self.spent_s(), 1), *mean))
            save(self.out, self.model, self.normalize)
        return self.spent_s() < self.processor_s


def save(out, model, normalize):
    """A checkpoint; what is there is replaced when it is whole."""
    for name, write in (
        ("memory.pkl", model.save_replay_buffer),
        ("normalize.pkl", normalize.save),
        ("model.zip", model.save),
    ):
        write(out / f"new_{name}")
        (out / f"new_{name}").replace(out / name)


def train(out, minutes, seed):
    out.mkdir(parents=True, exist_ok=True)
    environments = SB3VecEnv(learning_task(), ENVIRONMENTS, seed=seed)
    if (out / "model.zip").exists():
        normalize = VecNormalize.load(out / "normalize.pkl", environments)
        model = SAC.load(out / "model.zip", env=normalize, device="cpu")
        if model.seed != seed:
            raise SystemExit(f"{out} is learnt from seed {model.seed}, not {seed}: take another folder or seed")
        model.load_replay_buffer(out / "memory.pkl")
        with (out / "curve.csv").open() as file:
            before_s = float(list(csv.reader(file))[-1][1])
    else:
        normalize, before_s = VecNormalize(environments, norm_reward=False, clip_obs=5.0), 0.0
        settings = {
            "learning_rate": 1e-3,
            "buffer_size": 100_000,
            "batch_size": 256,
            "gamma": 0.98,
            "tau": 0.01,
            "ent_coef": "auto_0.1",
            "learning_starts": 0,
            "gradient_steps": ENVIRONMENTS // 2,
            "policy_kwargs": {"net_arch": [128, 128]},
        }
        model = SAC("MultiInputPolicy", normalize, **settings, seed=seed, device="cpu")
        for name, steps in FIRST.items():
            remember(model, normalize, known_policy(out, name, seed), steps)
        print(
            f"remembers {sum(FIRST.values()) * ENVIRONMENTS} steps, {time.process_time():.0f} s", flush=True
        )
        with (out / "curve.csv").open("w", newline="") as file:
            csv.writer(file).writerows([CURVE, (0, round(time.process_time(), 1), "", "")])
    model.learn(
        100_000_000, callback=Watch(out, normalize, 60.0 * minutes, before_s), reset_num_timesteps=False
    )
    save(out, model, normalize)


class Patient:
    """A policy whose instruments stay when its episode has taken so many seconds of processor time."""

    def __init__(self, policy, most_s):
        self.policy, self.most_s, self.began_s, self.given_up = policy, most_s, time.process_time(), False

    def act(self, episodes):
        self.given_up |= time.process_time() - self.began_s > self.most_s
        return np.zeros_like(episodes.action) if self.given_up else self.policy.act(episodes)


def known_policy(out, name, seed):
    if name == "random":
        return policies.Uniform(seed)
    if name == "straight":
        return policies.Straight()
    steered = {"follow": "follow_path", "look-ahead": "search_ahead", "plan": "plan"}
    if name in steered:
        return policies.Steered(steered[name])
    normalize = VecNormalize.load(out / "normalize.pkl", SB3VecEnv(unseen_task(), 1))
    model = SAC.load(out / "model.zip", device="cpu")
    return Learned(model, normalize, seed=None if name == "learnt-mean" else seed)


def evaluate(out, episodes, names, most_s, kind):
    """A row for each episode; those that are there already are not run again. Returns how many have arrived of each policy."""
    out.mkdir(parents=True, exist_ok=True)
    file = out / "evaluation.csv"
    rows = list(csv.DictReader(file.open())) if file.exists() else []
    if rows and "task" not in rows[0]:
        raise SystemExit(f"{file} does not say of which task it is, as earlier versions: take another folder")
    own = [row for row in rows if row["task"] == kind]
    arrived = {}
    with file.open("a", newline="") as appended:
        writer = csv.DictWriter(appended, EVALUATION)
        if not rows:
            writer.writeheader()
        for name in names:
            there = {int(row["seed"]) for row in own if row["policy"] == name}
            for seed in [seed for seed in EVALUATED[:episodes] if seed not in there]:
                policy = Patient(known_policy(out, name, seed), most_s)
                began = time.process_time()
                (outcome,) = evaluation.evaluate(unseen_task(kind), policy, [seed])
                row = {"task": kind, "policy": name, **vars(outcome), "out_of_time": policy.given_up}
                own.append({**row, "processor_s": round(time.process_time() - began, 2)})
                writer.writerow(own[-1])
                appended.flush()
            arrived[name] = summarise(f"{kind} {name}", [row for row in own if row["policy"] == name])
    return arrived


def summarise(name, rows):
    reached = [row for row in rows if str(row["reached"]) == "True"]
    low, high = evaluation.interval(len(reached), len(rows))
    safe = sum(str(row["safe_success"]) == "True" for row in rows)
    steps = np.median([int(row["steps"]) for row in reached]) if reached else np.nan
    lost = sum(str(row["out_of_time"]) == "True" for row in rows)
    spent = np.median([float(row["processor_s"]) for row in rows])
    print(
        f"{name:24}{len(reached):4} of {len(rows)}, {len(reached) / len(rows):5.1%}, 95 % {low:.1%} to {high:.1%}, safe {safe}; "
        f"median of those that arrived {steps:.0f} steps; out of time {lost}; {spent:.1f} s an episode",
        flush=True,
    )
    return len(reached)


def plot(folders, picture):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6.4, 3.2), dpi=100)
    for out in folders:
        with (out / "curve.csv").open() as file:
            rows = [row for row in csv.DictReader(file) if row["reached"]]
        minutes = [float(row["processor_s"]) / 60.0 for row in rows]
        axes.plot(minutes, [100.0 * float(row["reached"]) for row in rows])
    axes.set(xlabel="processor time, min", ylabel="of the last 100 episodes arrived, %", ylim=(0, 100))
    figure.tight_layout()
    figure.savefig(picture)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=["train", "evaluate", "plot"])
    parser.add_argument("out", type=Path, nargs="+", help="a folder for each seed")
    parser.add_argument("--seed", type=int, default=1, help="of the first folder; each one more takes the next")
    parser.add_argument("--minutes", type=float, default=45.0, help="processor time of training in all")
    parser.add_argument("--episodes", type=int, default=60)
    parser.add_argument(
        "--policies", nargs="*", default=["random", "straight", "follow", "look-ahead", "learnt"]
    )
    parser.add_argument("--most-s", type=float, default=30.0, help="processor time of an episode; inf for no limit")
    parser.add_argument("--task", choices=TASKS, default="strict", help="what loses an episode of evaluation")
    parser.add_argument("--picture", type=Path)
    args = parser.parse_args()
    torch.set_num_threads(1)
    if args.what == "train":
        for k, out in enumerate(args.out):
            train(out, args.minutes, args.seed + k)
    elif args.what == "evaluate":
        # What does not learn is the same for all seeds.
        arrived = [
            evaluate(out, args.episodes, ["learnt"] if k else args.policies, args.most_s, args.task)
            for k, out in enumerate(args.out)
        ]
        if len(arrived) > 1:
            learnt = [of.get("learnt", 0) for of in arrived]
            print(f"learnt, of {args.episodes}: {learnt}, mean {np.mean(learnt):.1f}")
    else:
        plot(args.out, args.picture or args.out[0] / "curve.png")


if __name__ == "__main__":
    main()
