"""Learns to steer a wire into the branches of aortic arches that it has never seen: ArchVariety with stable-baselines3.

    python crates/python/examples/learn_arch.py train out/learn          # begins, or goes on where it was stopped
    python crates/python/examples/learn_arch.py evaluate out/learn       # what has been learnt, and what does not learn, on unseen arches
    python crates/python/examples/learn_arch.py plot out/learn           # the curve

What is learnt: first to do what a hand of the library did that follows the centre line (behaviour cloning on the episodes in which it arrived), then
PPO from there. The policy sees a roadmap of the way ahead from the tip, and its last action; nothing of the wall. It learns on a hundred arches that are
kept, with rewards of its own; evaluation is the task's own in all but what is observed, each episode in a new arch.
"""

import argparse
import csv
import time
from collections import deque
from pathlib import Path

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecNormalize

from endowire.gym import Episodes, arches, ends, evaluation, observations, policies, rewards, tasks
from endowire.gym.sb3 import Learned, SB3VecEnv

#: Arches that are learnt on come from this seed, those of evaluation from the seeds of their episodes.
LEARNING_SEED = 1
CHECKED, EVALUATED = range(800_000, 800_020), range(900_000, 901_000)
ENVIRONMENTS, STEPS = 16, 128
SEEN = {"roadmap": observations.Roadmap(), "last_action": observations.LastAction()}
EVALUATION = (
    "policy",
    "seed",
    "reached",
    "steps",
    "way_mm",
    "safety",
    "failure",
    "out_of_time",
    "processor_s",
)
CURVE = ("steps", "processor_s", "reached", "reached_unseen", "return")


def learning_task():
    """Arches that are kept, five times the reward for the way against that at its end, and ends after 250 steps or where steps take seconds."""
    return tasks.arch_variety(
        vessels=arches.ArchVariety(count=100, seed=LEARNING_SEED),
        observations=SEEN,
        rewards=[rewards.Reached(2.0), rewards.EachStep(-0.01), rewards.Approach(0.01)],
        ends=[ends.TargetReached(), ends.LeftVessel(), ends.Laborious(), ends.StepLimit(250)],
    )


def unseen_task(most_steps=1000):
    """The task with a new arch in each episode."""
    limits = [ends.TargetReached(), ends.LeftVessel(), ends.StepLimit(most_steps)]
    return tasks.arch_variety(vessels=arches.ArchVariety(count=None), observations=SEEN, ends=limits)


def demonstrations(task, episodes, seed):
    """What is seen and done in the episodes in which the hand that follows the centre line arrives, steps without a move left out."""
    hand, seen, done = policies.Steered("follow_path"), {name: [] for name in SEEN}, []
    for k in range(episodes):
        one, course = Episodes(task, 1), []
        one.begin({0: np.random.default_rng([seed, k])})
        while not any(np.concatenate(one.ended())):
            observed, action = one.observe(), hand.act(one)
            course.append((observed, action / one.action_space.high))
            one.step(action, np.array([True]))
        if one.reached[0]:
            for observed, action in course:
                if action.any():
                    done.append(action[0])
                    for name, values in observed.items():
                        seen[name].append(values[0])
    return {name: np.array(values) for name, values in seen.items()}, np.clip(np.array(done), -1.0, 1.0)


def clone(model, normalize, seen, done, epochs=40, batch=256):
    """Brings the mean action near to what was done, by least squares."""
    for name, values in seen.items():
        normalize.obs_rms[name].update(values)
    inputs = {name: torch.as_tensor(v) for name, v in normalize.normalize_obs(seen).items()}
    wanted = torch.as_tensor(done, dtype=torch.float32).flatten(1)
    optimizer = torch.optim.Adam(model.policy.parameters(), lr=1e-3)
    generator = torch.Generator().manual_seed(LEARNING_SEED)
    for _ in range(epochs):
        order = torch.randperm(len(wanted), generator=generator)
        for rows in order.split(batch):
            told = model.policy.get_distribution({name: v[rows] for name, v in inputs.items()})
            loss = ((told.distribution.mean - wanted[rows]) ** 2).mean()
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
    return float(loss.detach())


class Watch(BaseCallback):
    """Writes the curve and checkpoints, and stops in time."""

    def __init__(self, out, normalize, processor_s, before_s, check_every):
        super().__init__()
        self.out, self.normalize, self.check_every = out, normalize, check_every
        self.processor_s, self.before_s = processor_s, before_s
        self.ended, self.returns, self.running = deque(maxlen=200), deque(maxlen=200), np.zeros(ENVIRONMENTS)
        self.rollouts, self.checking_s = 0, 0.0

    def spent_s(self):
        return self.before_s + time.process_time() - self.checking_s

    def _on_step(self):
        self.running += self.locals["rewards"]
        for k in np.flatnonzero(self.locals["dones"]):
            self.ended.append(bool(self.locals["infos"][k]["reached"]))
            self.returns.append(self.running[k])
            self.running[k] = 0.0
        return self.spent_s() < self.processor_s

    def _on_rollout_end(self):
        self.rollouts += 1
        unseen = ""
        if self.check_every and self.rollouts % self.check_every == 0:
            began = time.process_time()
            outcomes = evaluation.evaluate(unseen_task(250), Learned(self.model, self.normalize), CHECKED)
            unseen = np.mean([outcome.reached for outcome in outcomes])
            self.checking_s += time.process_time() - began
        mean = [np.mean(values) if values else "" for values in (self.ended, self.returns)]
        with (self.out / "curve.csv").open("a", newline="") as file:
            row = (self.num_timesteps, round(self.spent_s(), 1), mean[0], unseen, mean[1])
            csv.writer(file).writerow(row)
        save(self.out, self.model, self.normalize)


def save(out, model, normalize):
    """A checkpoint; what is there is replaced when it is whole."""
    for name, write in (("model.zip", model.save), ("normalize.pkl", normalize.save)):
        write(out / f"new_{name}")
        (out / f"new_{name}").replace(out / name)


def load(out, environments):
    normalize = VecNormalize.load(out / "normalize.pkl", environments)
    return PPO.load(out / "model.zip", env=normalize, device="cpu"), normalize


def train(out, minutes, check_every):
    out.mkdir(parents=True, exist_ok=True)
    environments = SB3VecEnv(learning_task(), ENVIRONMENTS, seed=LEARNING_SEED)
    if (out / "model.zip").exists():
        model, normalize = load(out, environments)
        with (out / "curve.csv").open() as file:
            before_s = float(list(csv.reader(file))[-1][1])
    else:
        normalize, before_s = VecNormalize(environments, norm_reward=False, clip_obs=5.0), 0.0
        networks = {"net_arch": {"pi": [64, 64], "vf": [128, 128]}, "log_std_init": -1.0}
        settings = {"n_steps": STEPS, "batch_size": 256, "n_epochs": 6, "gamma": 0.98, "target_kl": 0.03}
        model = PPO(
            "MultiInputPolicy",
            normalize,
            **settings,
            policy_kwargs=networks,
            seed=LEARNING_SEED,
            device="cpu",
        )
        seen, done = demonstrations(learning_task(), 60, LEARNING_SEED)
        loss = clone(model, normalize, seen, done)
        print(f"cloned {len(done)} steps, {loss:.4f} left, {time.process_time():.0f} s", flush=True)
        with (out / "curve.csv").open("w", newline="") as file:
            csv.writer(file).writerows([CURVE, (0, round(time.process_time(), 1), "", "", "")])
        save(out, model, normalize)
        model.save(out / "cloned.zip")
        normalize.save(out / "cloned.pkl")
        # The value of a state is learnt before the policy moves, or its first steps would undo what was cloned.
        policy = [*model.policy.mlp_extractor.policy_net.parameters(), *model.policy.action_net.parameters()]
        for parameter in [*policy, model.policy.log_std]:
            parameter.requires_grad_(False)
        watch = Watch(out, normalize, 60.0 * minutes, before_s, 0)
        model.learn(4 * ENVIRONMENTS * STEPS, callback=watch)
        for parameter in [*policy, model.policy.log_std]:
            parameter.requires_grad_(True)
    watch = Watch(out, normalize, 60.0 * minutes, before_s, check_every)
    model.learn(100_000_000, callback=watch, reset_num_timesteps=False)
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
    if name in ("follow", "look-ahead"):
        return policies.Steered({"follow": "follow_path", "look-ahead": "search_ahead"}[name])
    model, normalized = {"cloned": ("cloned", "cloned"), "learnt": ("model", "normalize")}[name]
    normalize = VecNormalize.load(out / f"{normalized}.pkl", SB3VecEnv(unseen_task(), 1))
    return Learned(PPO.load(out / f"{model}.zip", device="cpu"), normalize)


def evaluate(out, episodes, names, most_s):
    """A row for each episode; those that are there already are not run again."""
    file = out / "evaluation.csv"
    rows = list(csv.DictReader(file.open())) if file.exists() else []
    with file.open("a", newline="") as appended:
        writer = csv.DictWriter(appended, EVALUATION)
        if not rows:
            writer.writeheader()
        for name in names:
            there = {int(row["seed"]) for row in rows if row["policy"] == name}
            for seed in [seed for seed in EVALUATED[:episodes] if seed not in there]:
                policy = Patient(known_policy(out, name, seed), most_s)
                began = time.process_time()
                (outcome,) = evaluation.evaluate(unseen_task(), policy, [seed])
                told = {"policy": name, **vars(outcome), "out_of_time": policy.given_up}
                rows.append({**told, "processor_s": round(time.process_time() - began, 2)})
                writer.writerow(rows[-1])
                appended.flush()
            tell(name, [row for row in rows if row["policy"] == name])


def tell(name, rows):
    reached = [row for row in rows if str(row["reached"]) == "True"]
    low, high = evaluation.interval(len(reached), len(rows))
    steps = np.median([int(row["steps"]) for row in reached]) if reached else np.nan
    lost = sum(str(row["out_of_time"]) == "True" for row in rows)
    spent = np.median([float(row["processor_s"]) for row in rows])
    print(
        f"{name:11}{len(reached):4} of {len(rows)}, {len(reached) / len(rows):5.1%}, 95 % {low:.1%} to {high:.1%}; "
        f"median of those that arrived {steps:.0f} steps; out of time {lost}; {spent:.1f} s an episode",
        flush=True,
    )


def plot(out, picture):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    with (out / "curve.csv").open() as file:
        rows = list(csv.DictReader(file))
    minutes = [float(row["processor_s"]) / 60.0 for row in rows]
    figure, axes = pyplot.subplots(figsize=(6.4, 3.2), dpi=100)
    for key, label, style in (
        ("reached", "on arches learnt on, with noise", "-"),
        ("reached_unseen", "on 20 unseen arches", "o"),
    ):
        points = [(m, 100.0 * float(row[key])) for m, row in zip(minutes, rows, strict=True) if row[key]]
        if points:
            axes.plot(*zip(*points, strict=True), style, label=label, markersize=4)
    axes.set(xlabel="processor time, min", ylabel="episodes that arrive, %", ylim=(0, 100))
    axes.legend(loc="lower right")
    figure.tight_layout()
    figure.savefig(picture)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=["train", "evaluate", "plot"])
    parser.add_argument("out", type=Path)
    parser.add_argument("--minutes", type=float, default=45.0, help="processor time of training in all")
    parser.add_argument("--check-every", type=int, default=20, help="rollouts between looks at unseen arches")
    parser.add_argument("--episodes", type=int, default=60)
    parser.add_argument(
        "--policies", nargs="*", default=["random", "straight", "follow", "look-ahead", "cloned", "learnt"]
    )
    parser.add_argument("--most-s", type=float, default=30.0, help="processor time of an episode")
    parser.add_argument("--picture", type=Path)
    told = parser.parse_args()
    torch.set_num_threads(1)
    if told.what == "train":
        train(told.out, told.minutes, told.check_every)
    elif told.what == "evaluate":
        evaluate(told.out, told.episodes, told.policies, told.most_s)
    else:
        plot(told.out, told.picture or told.out / "curve.png")


if __name__ == "__main__":
    main()
