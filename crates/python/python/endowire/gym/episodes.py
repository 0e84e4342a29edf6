"""Parallel episodes: the common part of the environments of a vector. A single environment is a vector of one."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from .. import Batch, EndOfWay, EndowireError, InputError, Record, Simulation
from . import checks
from .centreline import Path, Ways
from .reach import why_not
from .scaling import shown
from .task import Task
from .vessels import Site

#: So many targets are drawn for an episode until one is not within the threshold of the tip.
_DRAWS = 100
#: Largest number of frames of an episode; each frame has its own noise.
_FRAMES = 1 << 20


class Episodes:
    """The episodes of ``n`` environments. Parts of a task read its attributes; arrays have n rows."""

    def __init__(self, task: Task, n: int) -> None:
        self.task = task
        n = checks.whole("num_envs", n, 1)
        self.action_space = task.action_space()
        self._limits = task.limits()
        self._spaces = task.observation_spaces()
        self._shown = shown(task)
        self.observation_space = spaces.Dict(self._spaces)
        instruments = len(task.instruments)
        self._lengths_mm = np.array([instrument.length_mm for instrument in task.instruments])
        #: The simulations.
        self.batch: Batch = Batch([])
        #: The site of each environment.
        self.sites: list[Site] = []
        #: Target positions, mm, shape (n, 3).
        self.target_mm = np.zeros((n, 3))
        #: Tip positions, mm, shape (n, 3).
        self.tip_mm = np.zeros((n, 3))
        #: Path length along the centre line to the target, mm, shape (n,), now and before the last step.
        self.way_mm, self.way_before_mm = np.zeros(n), np.zeros(n)
        #: The same at the beginning of the episode, shape (n,).
        self.way_begun_mm = np.zeros(n)
        #: The path from the root of the centre line to the target, for each environment.
        self.paths: list[Path | None] = [None] * n
        #: Whether the tip has reached the target, shape (n,).
        self.reached = np.zeros(n, dtype=bool)
        #: Number of steps, shape (n,).
        self.steps = np.zeros(n, dtype=int)
        #: Number of steps after which no contact force exceeded the task's limit, shape (n,).
        self.safe_steps = np.zeros(n, dtype=int)
        #: The largest wall force at a contact, and the sum of those at the tip, N, shape (n, 2): current values, and
        #: maxima of the episode.
        self.force_n, self.largest_force_n = np.zeros((n, 2)), np.zeros((n, 2))
        #: Distance that the tip has travelled in the episode, mm, shape (n,): summed over the steps.
        self.path_length_mm = np.zeros(n)
        #: Whether the episode was over at the last call of `ended`, shape (n,).
        self._over = np.zeros(n, dtype=bool)
        #: Start of the episode, s of the machine's clock, shape (n,).
        self._begun_s = np.zeros(n)
        #: Frame number, shape (n,): seeds the noise of pictures.
        self.frame = np.zeros(n, dtype=np.int64)
        #: Last velocities, clipped to the limits, mm/s and rad/s, shape (n, n_instruments, 2); NaN keeps the previous
        #: value.
        self.action = np.zeros((n, instruments, 2))
        #: Records of the episodes, if the task is assessed.
        self.records: list[Record | None] = [None] * n
        #: Failures in the last step: exceptions by environment.
        self.failures: dict[int, EndowireError] = {}
        self._ways = Ways(n)

    def begin(self, generators: dict[int, np.random.Generator]) -> None:
        """Begins episodes of these environments; all random numbers come from their generators."""
        sampled = {k: self.task.vessels.sample(rng) for k, rng in generators.items()}
        starts = {k: self.task.start(site) for k, site in sampled.items()}
        if not self.sites:
            self.batch = Batch([starts[k] for k in sorted(starts)])
            self.sites = [sampled[k] for k in sorted(sampled)]
        for k, rng in generators.items():
            site, simulation = sampled[k], starts[k].copy()
            # A shaped tip leaves the sheath at a random roll angle.
            simulation.step(rotate_rad=[rng.uniform(0.0, 2.0 * np.pi) for _ in self.task.instruments])
            self.batch.replace(k, simulation)
            self.sites[k] = site
            self.target_mm[k] = self._target_mm(rng, site, starts[k])
            self.paths[k] = site.centreline.path(self.target_mm[k])
            self._ways.put(k, site.centreline, self.target_mm[k])
            self.frame[k] = int(rng.integers(1 << 30)) * _FRAMES
            self.steps[k], self.safe_steps[k], self.action[k] = 0, 0, 0.0
            self.force_n[k] = self.largest_force_n[k] = 0.0
            self.path_length_mm[k], self._begun_s[k] = 0.0, perf_counter()
            self._over[k] = False
            self.records[k] = Record(simulation) if self.task.assessed else None
            self.failures.pop(k, None)
        self._look()
        for k in generators:
            self.way_before_mm[k] = self.way_begun_mm[k] = self.way_mm[k]

    def _target_mm(self, rng: np.random.Generator, site: Site, start: Simulation) -> NDArray[np.float64]:
        """The target of an episode, which the tip must be able to reach and has not reached at the beginning."""
        for _ in range(_DRAWS):
            target_mm = checks.place_mm("target", self.task.target.sample(rng, site, start))
            self._check_inside(target_mm, site)
            off_mm = float(np.linalg.norm(target_mm - start.tip_mm))
            if off_mm < self.task.threshold_mm:
                continue
            why = why_not(site, start, target_mm, self.task.threshold_mm)
            if why:
                raise InputError(f"target = {target_mm.tolist()}: cannot be reached: {why}")
            return target_mm
        raise InputError(
            f"threshold_mm = {self.task.threshold_mm}: the target, {off_mm:.1f} mm from the tip in the sheath, is reached before "
            "the first step: give a smaller threshold, or a target that is farther away"
        )

    def _check_inside(self, target_mm: NDArray[np.float64], site: Site) -> None:
        """Refuses a target outside the vessel, by more than the threshold."""
        segment, _, off_mm = site.centreline.nearest(target_mm)
        # The centre line may be off the axis, so only far from it it is asked whether the target is in the vessel.
        line = site.centreline
        radius_mm = line.radii_mm[[line.begin_rows[segment], line.end_rows[segment]]].max()
        near_mm = radius_mm + self.task.threshold_mm
        if off_mm > near_mm and not site.vessel.contains(target_mm[None])[0]:
            raise InputError(
                f"target = {target_mm.tolist()}: is outside the vessel, {off_mm:.1f} mm from its centre line: "
                "give a place inside, mm"
            )

    def step(self, velocities: NDArray[np.float64], moving: NDArray[np.bool_]) -> None:
        """Moves the selected environments by velocities, mm/s and rad/s, shape (n, n_instruments, 2), clipped to the
        limits; the others wait. A simulation refuses NaN, which counts as its failure.

        Raises Gymnasium's ResetNeeded before the first `begin`.
        """
        self.check_begun("step")
        velocities = np.clip(velocities, -self._limits, self._limits)
        done = moving & ~np.isnan(velocities).any(axis=(1, 2))
        self.action = np.where(done[:, None, None], velocities, self.action)
        moves, behind = velocities * self.task.control_period_s, self.batch.behind
        # An instrument whose commanded motion is ahead by a full step waits.
        most = self._limits * self.task.control_period_s
        moves = np.clip(moves, np.minimum(-most - behind, 0.0), np.maximum(most - behind, 0.0))
        # No instrument is pushed in beyond its end or pulled out of the sheath, even if it has not yet followed its
        # commands.
        inserted_mm = self.batch.inserted_mm + behind[..., 0]
        moves[..., 0] = np.clip(moves[..., 0], -inserted_mm, self._lengths_mm - inserted_mm)
        moves[~moving] = 0.0
        solves = self.task.solves
        stopped = self.batch.step(moves) if solves is None else self.batch.tick(moves, solves)
        # Where the way ends an instrument stays, but can be pulled back.
        self.failures = {k: failure for k, failure in stopped.items() if not isinstance(failure, EndOfWay)}
        self.steps += moving
        if self.task.assessed:
            moves[list(stopped)] = 0.0
            noted = [record if moves_now else None for record, moves_now in zip(self.records, moving, strict=True)]
            self.batch.note(noted, moves, self.steps * self.task.control_period_s)
        self.safe_steps += moving & (self.batch.largest_contact_force_n <= self.task.force_limit_n)
        self.frame += moving
        self.force_n = np.where(moving[:, None], self.batch.wall_forces_n, self.force_n)
        self.largest_force_n = np.maximum(self.largest_force_n, self.force_n)
        tip_before_mm = self.tip_mm
        self.way_before_mm = self.way_mm.copy()
        self._look()
        self.path_length_mm += np.where(moving, np.linalg.norm(self.tip_mm - tip_before_mm, axis=1), 0.0)

    def check_begun(self, what: str) -> None:
        """Raises Gymnasium's ResetNeeded if no episode has begun, since there is nothing to step or draw."""
        if not self.sites:
            raise ResetNeeded(f"reset comes before {what}: call reset once first")

    def observe(self) -> dict[str, NDArray[Any]]:
        """All observations, clipped to their spaces.

        Raises InputError for a part whose numbers have another shape than its space, or are not finite.
        """
        observed = {}
        for name, part in self._shown.items():
            space, n = self._spaces[name], len(self.sites)
            values = checks.an_array(f"observations[{name!r}]", part.observe(self))
            if values.shape != (n, *space.shape):
                raise InputError(
                    f"observations[{name!r}] = an array of shape {values.shape}: must have the shape "
                    f"{(n, *space.shape)}, of its space for each environment"
                )
            if values.dtype == np.uint8:
                observed[name] = values
                continue
            if values.dtype.kind not in "biuf" or not np.isfinite(values).all():
                raise InputError(f"observations[{name!r}]: every number must be real and finite")
            observed[name] = np.clip(values, space.low, space.high).astype(space.dtype)
        return observed

    def rewards(self) -> NDArray[np.float64]:
        """The sum of all rewards, shape (n,).

        Raises InputError for a reward of another shape, and for one that is not finite.
        """
        total = np.zeros(len(self.sites))
        for index, part in enumerate(self.task.rewards):
            name = f"rewards[{index}]"
            values = checks.of_each(name, part, part.reward(self), len(total))
            if not np.isfinite(values).all():
                raise InputError(f"{name} = {values.tolist()} from {type(part).__name__}: every number must be finite")
            total += values
        return total

    def ended(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Terminated and truncated, shape (n,); failed episodes are truncated."""
        n = len(self.sites)
        terminated, truncated = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
        for index, end in enumerate(self.task.ends):
            values = checks.of_each(f"ends[{index}]", end, end.ended(self), n)
            (terminated if end.terminates else truncated).__ior__(values != 0)
        truncated[list(self.failures)] = True
        self._over = terminated | truncated
        return terminated, truncated

    def info(self) -> dict[str, NDArray[Any]]:
        """Further information, one row per environment; call it after `ended`, which determines the episodes that are
        over.
        """
        failed = np.array([str(self.failures.get(k, "")) for k in range(len(self.sites))], dtype=object)
        safety = np.where(self.steps > 0, self.safe_steps / np.maximum(self.steps, 1), 1.0)
        info = {"reached": self.reached.copy(), "way_mm": self.way_mm.copy()}
        info |= {"safety": safety, "failure": failed}
        info |= {"steps": self.steps.copy(), "path_length_mm": self.path_length_mm.copy()}
        info |= {"behind_mm": np.abs(self.batch.behind[..., 0]).max(axis=1)}
        info |= {"wall_force_n": self.force_n[:, 0].copy(), "tip_force_n": self.force_n[:, 1].copy()}
        info |= {
            "largest_wall_force_n": self.largest_force_n[:, 0].copy(),
            "largest_tip_force_n": self.largest_force_n[:, 1].copy(),
        }
        # Whether all forces in the episode were below the task's limit. The tip force is a sum over contacts and can
        # exceed it even if no single contact does.
        is_safe = (self.largest_force_n <= self.task.force_limit_n).all(axis=1)
        # Run time is not reproducible, so it is given only for episodes that are over.
        took_s = np.where(self._over, perf_counter() - self._begun_s, 0.0)
        info |= {"safe_success": self.reached & is_safe, "wall_time_s": took_s}
        if self.task.assessed:
            info["assessment"] = np.full(len(self.sites), None, dtype=object)
            for k in np.flatnonzero(self._over):
                record, vessel = self.records[k], self.sites[k].vessel
                if record is not None:
                    info["assessment"][k] = record.assess(vessel, self.target_mm[k], self.task.threshold_mm)
        if self.task.stand_in:
            info["stand_in"] = np.full(len(self.sites), self.task.stand_in, dtype=object)
        return info

    def _look(self) -> None:
        self.tip_mm = self.batch.tip_mm
        self.reached = np.linalg.norm(self.tip_mm - self.target_mm, axis=1) < self.task.threshold_mm
        self.way_mm = self._ways.left_mm(self.tip_mm)
