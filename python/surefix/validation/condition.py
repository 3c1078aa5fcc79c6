"""What is known of the truth by someone who knows the scenario, and is told all modes but those of
the last steps: exact, and nothing of the filter under test is in it.

Given the modes all is linear and Gaussian, so that Kalman's filter gives the truth at the end and
the density of the readings. Every combination of modes of the last steps is gone through. To put
this conditional expectation in place of one truth and one history of modes leaves every mean as it
is, and takes the rarity of tails and of late faults out of it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

import surefix as sf
from surefix.core.checks import FloatArray
from surefix.validation.importance import Proposal, chains
from surefix.validation.scenario import Scenario
from surefix.validation.simulate import Runs

Indices = npt.NDArray[np.int64]


class Condition:
    """Histories (H,) of modes of a few runs, as they grow step by step."""

    def __init__(
        self, scenario: Scenario, proposals: Sequence[Proposal], counts: Sequence[int], runs: Runs
    ) -> None:
        self.scenario, self.biases = scenario, scenario.biases()
        self.schedule, self.runs = scenario.schedule(), runs
        sizes = [len(G) for G in scenario.chains()]
        self.vectors = np.array(list(itertools.product(*map(range, sizes))))
        every = [Proposal(1.0), *proposals]
        self.tables = [_joint(chains(scenario, proposal), self.vectors) for proposal in every]
        self.log_share = np.log(np.array(counts) / sum(counts))
        N, n, m = len(runs.value), scenario.model.size, scenario.model.size + len(self.biases)
        place = {tuple(v): i for i, v in enumerate(self.vectors.tolist())}
        told = [[place[tuple(v)] for v in run] for run in runs.modes.transpose(0, 2, 1).tolist()]
        self.told = np.array(told, dtype=np.int64)  # (N, T)
        self.run = np.arange(N)
        self.mode = np.zeros(N, dtype=np.int64)
        self.log_prior = np.zeros((len(every), N))
        self.log_density = np.zeros(N)
        self.n, self.m = n, m
        self.x = np.zeros((m, N))
        self.P = np.zeros((m, m, N))
        for i in range(n):
            self.x[i], self.P[i, i] = scenario.x0[i], scenario.P0[i]
        self.read = 0

    def to_the_end(self, window: int) -> None:
        """All steps; the modes of the last ``window`` are not told."""
        now = 0.0
        for k, end in enumerate(self.scenario.times().tolist()):
            if k < self.scenario.steps - window:
                self._enter(k, self.told[self.run, k])
            else:
                self._branch()
                count = len(self.vectors)
                self._enter(k, np.tile(np.arange(count), len(self.run) // count))
            while self.read < len(self.schedule) and self.schedule[self.read][0] <= end:
                time, s = self.schedule[self.read]
                self._move(time - now)
                self._update(s, self.runs.value[self.run, self.read])
                self.read, now = self.read + 1, time
            self._move(end - now)
            now = end

    def weighed(self, value: FloatArray) -> FloatArray:
        """Of ``value`` (H, ...), per run: its mean over the histories, times the run's weight, the
        density of what is told over that under all proposals (N, ...)."""
        mixed = self.log_prior[1:] + self.log_share[:, None]
        top = mixed.max(axis=0)
        log_q = top + np.log(np.exp(mixed - top).sum(axis=0)) + self.log_density
        N = len(self.runs.value)
        log_q = log_q.reshape(N, -1)
        highest = log_q.max(axis=1, keepdims=True)
        total = np.exp(log_q - highest).sum(axis=1)
        log_p = (self.log_prior[0] + self.log_density).reshape(N, -1)
        p = np.exp(log_p - highest).reshape(N, -1, *([1] * (value.ndim - 1)))
        summed = (p * value.reshape(N, p.shape[1], *value.shape[1:])).sum(axis=1)
        result: FloatArray = summed / total.reshape(N, *([1] * (value.ndim - 1)))
        return result

    @property
    def mean(self) -> FloatArray:
        """Of the speed at the end (H,)."""
        found: FloatArray = self.x[self.scenario.model.output]
        return found

    @property
    def sigma(self) -> FloatArray:
        """Of the speed at the end (H,)."""
        speed = self.scenario.model.output
        found: FloatArray = np.sqrt(self.P[speed, speed])
        return found

    def _branch(self) -> None:
        each = len(self.vectors)
        self.run, self.mode = np.repeat(self.run, each), np.repeat(self.mode, each)
        self.log_prior = np.repeat(self.log_prior, each, axis=-1)
        self.log_density = np.repeat(self.log_density, each)
        self.x, self.P = np.repeat(self.x, each, axis=-1), np.repeat(self.P, each, axis=-1)

    def _enter(self, k: int, mode: Indices) -> None:
        """The modes of step ``k`` begin."""
        for table, total in zip(self.tables, self.log_prior, strict=True):
            total += table[k][self.mode if k else 0, mode]
        for j, bias in enumerate(self.biases, start=self.n):
            now = self.vectors[mode, bias.chain] == bias.mode
            goes_on = now & (self.vectors[self.mode, bias.chain] == bias.mode) & (k > 0)
            self.x[j] *= goes_on
            self.P[j] *= goes_on
            self.P[:, j] *= goes_on
            self.P[j, j] += bias.sigma**2 * (now & ~goes_on)
        self.mode = mode

    def _move(self, dt: float) -> None:
        if dt <= 0:
            return
        F, Q = self.scenario.model.transition(dt)
        n, x, P = self.n, self.x, self.P
        for i, j in itertools.combinations(range(n), 2):  # F is upper triangular with ones
            x[i] += F[i, j] * x[j]
            P[i] += F[i, j] * P[j]
        for i, j in itertools.combinations(range(n), 2):
            P[:, i] += F[i, j] * P[:, j]
        P[:n, :n] += Q[:, :, None]
        for j, bias in enumerate(self.biases, start=n):
            P[j, j] += bias.walk**2 * dt * (self.vectors[self.mode, bias.chain] == bias.mode)

    def _update(self, s: int, value: FloatArray) -> None:
        sensor, speed = self.scenario.sensors[s], self.scenario.model.output
        rows = [speed, *(j for j, b in enumerate(self.biases, start=self.n) if s in b.sensors)]
        PH = self.P[rows].sum(axis=0)
        S = PH[rows].sum(axis=0) + sensor.sigma**2
        innovation = value - self.x[rows].sum(axis=0)
        log_density = -0.5 * (np.log(2 * math.pi * S) + innovation**2 / S)
        used = np.ones(len(value))
        for mode, fault in enumerate(sensor.faults, start=1):
            if isinstance(fault, sf.Outage):
                out = self.vectors[self.mode, s] == mode
                inside = np.abs(value - self.scenario.centre) <= fault.span / 2
                uniform = np.where(inside, -math.log(fault.span), -1e6)
                log_density = np.where(out, uniform, log_density)
                used = used * ~out
        self.log_density += log_density
        K = PH * (used / S)
        self.x += K * innovation
        for i in range(self.m):
            self.P[i] -= K[i] * PH


def outside(
    scenario: Scenario,
    proposals: Sequence[Proposal],
    counts: Sequence[int],
    runs: Runs,
    limits: FloatArray,
    window: int,
) -> FloatArray:
    """Of every run, weight and weighted probability that the truth is outside each of ``limits``
    (N, risks, 2): (N, 1 + risks)."""
    found = Condition(scenario, proposals, counts, runs)
    found.to_the_end(window)
    each = len(found.run) // len(runs.value)
    lower, upper = (np.repeat(limits[:, :, side], each, axis=0) for side in (0, 1))
    mean, sigma = found.mean[:, None], found.sigma[:, None]
    mass = tail((mean - lower) / sigma) + tail((upper - mean) / sigma)
    return found.weighed(np.concatenate([np.ones_like(mean), mass], axis=1))


def tail(z: FloatArray) -> FloatArray:
    """P(N(0, 1) > z)."""
    flat = [0.5 * math.erfc(value) for value in (z / math.sqrt(2)).ravel().tolist()]
    return np.array(flat).reshape(z.shape)


def _joint(tables: Sequence[Sequence[FloatArray]], vectors: Indices) -> list[FloatArray]:
    """log probability of every mode vector after every other one, of each step."""
    joint = []
    for k in range(len(tables[0])):
        total = np.zeros((1 if k == 0 else len(vectors), len(vectors)))
        for c, table in enumerate(tables):
            before = np.zeros(1, dtype=np.int64) if k == 0 else vectors[:, c]
            total += np.log(table[k][before[:, None], vectors[None, :, c]])
        joint.append(total)
    return joint
