"""How often the largest of many likelihood ratios is as large with no fault.

The K ratios of a search are far from independent, so neither one ratio's χ² nor K times its tail
says how often the largest of them exceeds u. With no fault they are quadratic forms of one Gaussian
vector whose law the record knows, and importance sampling gives the probability without bias, down
to any level (Naiman & Priebe 2001): draw one of the K at random, draw its ratio beyond u, draw all
the others given it; then P(max > u) = K P(χ² > u) E[1 / number of ratios beyond u].
"""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core.checks import FloatArray

Indices = npt.NDArray[np.intp]

WORK = 100_000_000
"""Steps of all samples together beyond which only the bound is given: some seconds."""

CHUNK = 4_000_000
"""Numbers that are held at once."""

LEVELS = 33


class Search(Protocol):
    """K ratios numᵀG⁻¹num over N measurements, each χ² with q degrees of freedom with no fault."""

    inverse: FloatArray  # (K, q, q) G⁻¹
    usable: Indices  # those that are detectable
    work: int  # of one sample

    @property
    def variances(self) -> FloatArray:
        """(N,) of the innovations."""

    def near(self, which: int) -> Indices | None:
        """Those that depend on one of them; None: all."""

    def numerators(self, innovations: FloatArray, at: Indices | None = None) -> FloatArray:
        """(runs, K or len(at), q)."""

    def response(self, which: int) -> FloatArray:
        """(q, N): innovations of a fault of unit amplitude."""


class FalseAlarm:
    """Probabilities of false alarms of one search, from ``samples`` draws.

    E[1 / number beyond u] is found once, for a grid of u that reaches to P(max > u) < 1e-14, from
    the schedule alone; between them its logarithm is interpolated, beyond them it hardly changes.
    """

    def __init__(self, search: Search, samples: int, seed: int) -> None:
        self._search = search
        self._q = float(search.inverse.shape[-1])
        self._count = len(search.usable)
        self._samples = samples
        self._seed = seed
        simulates = samples > 1 and self._count > 1 and search.work * samples <= WORK
        self.method = "simulation" if simulates else "bound"

    def of(self, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
        """P(max ratio > each), and its standard error: 0 where it is the bound
        min(1, K P(χ² > ratio)), which holds however the ratios depend on one another."""
        if self.method == "bound":
            return self.bound(ratio), np.zeros_like(ratio)
        tail = self._count * _core.chi_squared_tail(ratio, self._q)
        levels, mean, error = self._table
        share = np.exp(np.interp(ratio, levels, np.log(mean)))
        return np.minimum(tail * share, 1.0), tail * np.interp(ratio, levels, error)

    def bound(self, ratio: FloatArray) -> FloatArray:
        """min(1, K P(χ² > ratio))."""
        tail = self._count * _core.chi_squared_tail(ratio, self._q)
        result: FloatArray = np.minimum(tail, 1.0)
        return result

    def decides(self, ratio: FloatArray, probability: float) -> npt.NDArray[np.bool_]:
        """Whether P(max ratio > each) is on one side of ``probability`` whatever the dependence:
        it lies between P(χ² > ratio) of a single one and the bound."""
        single = _core.chi_squared_tail(ratio, self._q)
        result: npt.NDArray[np.bool_] = (single > probability) | (
            self._count * single <= probability
        )
        return result

    def threshold(self, probability: float) -> float:
        """The ratio that the largest exceeds with this probability."""
        high = float(_core.chi_squared_threshold(probability / self._count, self._q))
        if self.method == "bound":
            return high
        low = 0.0
        while high - low > 1e-9 * high:  # P falls from 1 at 0 to the bound at most
            middle = 0.5 * (low + high)
            beyond = self.of(np.array([middle]))[0][0] > probability
            low, high = (middle, high) if beyond else (low, middle)
        return high

    @cached_property
    def _table(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Levels, E[1 / number beyond], and its standard error."""
        top = float(_core.chi_squared_threshold(1e-14 / self._count, self._q))
        levels = np.linspace(0.0, top, LEVELS)
        counts = self._inverse_counts(levels)
        error = counts.std(0, ddof=1) / np.sqrt(len(counts))
        return levels, counts.mean(0), error

    def _inverse_counts(self, levels: FloatArray) -> FloatArray:
        """1 / number of ratios beyond each level, (samples, levels)."""
        search, q, N = self._search, int(self._q), len(self._search.variances)
        random = np.random.RandomState(self._seed)
        chosen = search.usable[random.randint(self._count, size=self._samples)]
        drawn = _beyond(levels, random.uniform(size=(self._samples, len(levels))), q)
        directions = random.normal(size=(self._samples, q))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        local = search.near(int(chosen[0])) is not None
        size = 1 if local else max(1, CHUNK // ((1 + q) * max(N, len(search.inverse) * q)))
        deviations = np.sqrt(search.variances)
        usable = np.zeros(len(search.inverse), bool)
        usable[search.usable] = True
        parts = []
        for first in range(0, self._samples, size):
            part = slice(first, first + size)
            own = chosen[part]
            at = search.near(int(own[0])) if local else None
            noise = random.normal(size=(len(own), N)) * deviations
            responses = np.concatenate([search.response(int(k)) for k in own])
            numerators = search.numerators(np.concatenate([noise, responses]), at)
            others = np.arange(len(usable)) if at is None else at
            counted = others[usable[others]]
            keep = np.flatnonzero(usable[others])
            parts.append(_counted(
                numerators[: len(own), keep],
                numerators[len(own) :, keep].reshape(len(own), q, len(keep), q),
                search.inverse[counted], np.searchsorted(counted, own), drawn[part],
                directions[part], levels,
            ))  # fmt: skip
        return np.concatenate(parts)


def _beyond(levels: FloatArray, uniform: FloatArray, q: int) -> FloatArray:
    """Draws of χ² with q degrees of freedom given that it is beyond each level."""
    tail = _core.chi_squared_tail(levels, float(q))
    drawn: FloatArray = np.maximum(_core.chi_squared_threshold(uniform * tail, float(q)), levels)
    return drawn


def _counted(
    numerators: FloatArray,  # (B, K, q) of noise alone
    responses: FloatArray,  # (B, q, K, q) of the chosen fault's amplitudes
    inverse: FloatArray,  # (K, q, q)
    own: Indices,  # (B,) the chosen one
    drawn: FloatArray,  # (B, levels) its ratio
    directions: FloatArray,  # (B, q) in which its numerator lies, whitened
    levels: FloatArray,
) -> FloatArray:
    """1 / number of ratios beyond each level: (B, levels).

    A fault of amplitude α added to the noise gives the chosen one the numerator that was drawn; all
    others follow. With √ratio = s their numerators are U + s V, their ratios quadratic in s.
    """
    B = np.arange(len(own))
    root = np.linalg.inv(np.linalg.cholesky(inverse[own]))  # rootᵀ root = G
    target = np.einsum("bca,bc->ba", root, directions)  # of ratio 1
    away = np.einsum("bac,bc->ba", inverse[own], numerators[B, own])
    towards = np.einsum("bac,bc->ba", inverse[own], target)
    U = numerators - np.einsum("ba,bakc->bkc", away, responses)
    V = np.einsum("ba,bakc->bkc", towards, responses)
    c0, c2 = quadratic(U, inverse), quadratic(V, inverse)
    c1 = (quadratic(U + V, inverse) - c0 - c2) / 2
    out = np.empty_like(drawn)
    for level, u in enumerate(levels):
        s = np.sqrt(drawn[:, level, None])
        ratio = c0 + s * (2 * c1 + s * c2)
        ratio[B, own] = drawn[:, level]
        out[:, level] = 1 / np.maximum(1, (ratio >= u).sum(1))
    return out


def quadratic(numerators: FloatArray, inverse: FloatArray) -> FloatArray:
    """numᵀ G⁻¹ num of (runs, K, q) and (K, q, q)."""
    q = inverse.shape[-1]
    result = np.zeros(np.broadcast_shapes(numerators.shape[:-1], inverse.shape[:1]))
    for a in range(q):
        for b in range(a, q):
            twice = 1 if a == b else 2
            result += (numerators[..., a] * (twice * inverse[:, a, b])) * numerators[..., b]
    return result
