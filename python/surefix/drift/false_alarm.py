"""How often the largest of many likelihood ratios is as large with no fault.

The K ratios of a search are far from independent, so neither one ratio's χ² nor K times its tail
says how often the largest of them exceeds u. With no fault they are quadratic forms of one Gaussian
vector whose law the record knows, and importance sampling gives the probability without bias, down
to any level (Naiman & Priebe 2001): draw one of the K at random, draw its ratio beyond u, draw all
the others given it; then P(max > u) = K P(χ² > u) E[1 / number of ratios beyond u].
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core.checks import FloatArray

Indices = npt.NDArray[np.intp]

WORK = 400_000_000
"""Measurements times ratios' costs of all samples beyond which only the bound is given."""

CHUNK = 4_000_000
"""Numbers that are held at once."""


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
    """Probabilities of false alarms of one search, from ``samples`` draws."""

    def __init__(self, search: Search, samples: int, seed: int) -> None:
        self._search = search
        self._q = search.inverse.shape[-1]
        self._count = len(search.usable)
        self._samples = samples
        self._seed = seed
        affordable = search.work * samples <= WORK
        self.method = "simulation" if affordable and samples > 0 else "bound"

    def probability(self, levels: FloatArray) -> tuple[FloatArray, FloatArray]:
        """P(max ratio > level) of each level, and its standard error: 0 where it is the bound
        min(1, K P(χ² > level)), which holds however the ratios depend on one another."""
        tail = self._count * _core.chi_squared_tail(levels, float(self._q))
        if self.method == "bound" or self._count <= 1:
            return np.minimum(tail, 1.0), np.zeros_like(levels)
        inverse_counts = self._inverse_counts(levels)  # (samples, levels)
        mean = inverse_counts.mean(0)
        error = inverse_counts.std(0, ddof=1) / np.sqrt(len(inverse_counts))
        return np.minimum(tail * mean, 1.0), tail * error

    def threshold(self, probability: float) -> float:
        """The level that the largest ratio exceeds with this probability."""
        q = float(self._q)
        low = float(_core.chi_squared_threshold(probability, q))
        high = float(_core.chi_squared_threshold(probability / self._count, q))
        if self.method == "bound" or self._count <= 1:
            return high
        levels = np.linspace(low, high, 9)
        found, _ = self.probability(levels)
        logs = np.minimum.accumulate(np.log(found))
        return float(np.interp(-np.log(probability), -logs, levels))

    def of(self, largest: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``probability`` of ratios (runs,); where they are many, log p is interpolated."""
        if len(largest) <= 16:
            return self.probability(largest)
        levels = np.linspace(largest.min(), largest.max(), 33)
        found, error = self.probability(levels)
        logs = np.log(np.maximum(found, 1e-300))
        return np.exp(np.interp(largest, levels, logs)), np.interp(largest, levels, error)

    def _inverse_counts(self, levels: FloatArray) -> FloatArray:
        search, q, N = self._search, self._q, len(self._search.variances)
        random = np.random.RandomState(self._seed)
        chosen = search.usable[random.randint(self._count, size=self._samples)]
        tails = random.uniform(size=(self._samples, len(levels)))
        directions = random.normal(size=(self._samples, q))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        local = self._count > 0 and search.near(int(chosen[0])) is not None
        size = 1 if local else max(1, CHUNK // max(1, (1 + q) * max(N, len(search.inverse) * q)))
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
            parts.append(_inverse_counts(
                numerators[: len(own), keep],
                numerators[len(own) :, keep].reshape(len(own), q, len(keep), q),
                search.inverse[counted], np.searchsorted(counted, own),
                _beyond(levels, tails[part], q), directions[part], levels,
            ))  # fmt: skip
        return np.concatenate(parts)


def _beyond(levels: FloatArray, uniform: FloatArray, q: int) -> FloatArray:
    """Draws of χ² with q degrees of freedom given that it is beyond each level."""
    tail = _core.chi_squared_tail(levels, float(q))
    far = tail < 1e-290  # there it falls as e^{-x/2}
    wanted = np.where(far, 0.5, uniform * np.where(far, 1.0, tail))
    drawn = np.where(
        far, levels - 2 * np.log(uniform), _core.chi_squared_threshold(wanted, float(q))
    )
    result: FloatArray = np.maximum(drawn, levels)
    return result


def _inverse_counts(
    numerators: FloatArray,  # (B, K, q) of noise alone
    responses: FloatArray,  # (B, q, K, q) of the chosen fault's amplitudes
    inverse: FloatArray,  # (K, q, q)
    own: Indices,  # (B,) the chosen one
    drawn: FloatArray,  # (B, levels) its ratio
    directions: FloatArray,  # (B, q) in which its numerator lies, whitened
    levels: FloatArray,
) -> FloatArray:
    """1 / number of ratios beyond each level: (B, levels)."""
    B = np.arange(len(own))
    root = np.linalg.inv(np.linalg.cholesky(inverse[own]))  # root⊤ root = G
    target = np.einsum("bca,bc->ba", root, directions)  # of ratio 1
    out = np.empty_like(drawn)
    for level in range(len(levels)):
        missing = np.sqrt(drawn[:, level, None]) * target - numerators[B, own]
        amplitude = np.einsum("bac,bc->ba", inverse[own], missing)
        shifted = numerators + np.einsum("ba,bakc->bkc", amplitude, responses)
        ratio = quadratic(shifted, inverse)
        ratio[B, own] = drawn[:, level]
        out[:, level] = 1 / np.maximum(1, (ratio >= levels[level]).sum(1))
    return out


def quadratic(numerators: FloatArray, inverse: FloatArray) -> FloatArray:
    """numᵀ G⁻¹ num of (runs, K, q) and (K, q, q)."""
    if inverse.shape[-1] == 1:
        alone: FloatArray = numerators[..., 0] ** 2 * inverse[:, 0, 0]
        return alone
    result: FloatArray = np.einsum("...kb,kbc,...kc->...k", numerators, inverse, numerators)
    return result
