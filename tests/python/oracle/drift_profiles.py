"""Faults of a known profile and an unknown onset, each onset by itself: sums over all pairs.

A fault adds d a to the measurements, d (M, q) the profile of unit amplitudes from its onset on,
a (q,) the amplitudes. script-L is exactly quadratic in z (not only to the first order of
Parellier, Barrau & Bonnabel 2023, eq. 10):

    script-L(z) - script-L(z - d a) = 2 a' num - a' G a,  num = d' Gamma^-1 gamma, G = d' Gamma^-1 d

so that the best amplitudes are G^-1 num, with covariance G^-1, and the best drop num' G^-1 num,
which with no fault is chi-square of q degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, expm

from oracle.drift import Dense, Long
from oracle.step import Array

Profile: TypeAlias = Callable[[Array], Array]  # elapsed (k,) >= 0 -> (k, q)
NOTHING = 1e-13  # a share of the information that rounding of the data alone can make


def step(elapsed: Array) -> Array:
    return np.ones((len(elapsed), 1))


def ramp(elapsed: Array) -> Array:
    return np.asarray(elapsed[:, None])


def exponential(time: float) -> Profile:
    """Towards 1 in ``time``; away from 0 where it is negative."""
    return lambda elapsed: np.asarray(-np.expm1(-elapsed / time)[:, None])


def sine(frequency: float) -> Profile:
    """a1 sin + a2 cos."""

    def value(elapsed: Array) -> Array:
        angle = 2.0 * np.pi * frequency * elapsed
        return np.stack([np.sin(angle), np.cos(angle)], axis=1)

    return value


def user(A: Array, output: Array, onset: Array) -> Profile:
    """output exp(A elapsed) onset; onset (p,) or (p, q)."""
    columns = onset.reshape(len(A), -1)
    return lambda elapsed: np.asarray(output @ (expm(A * elapsed[:, None, None]) @ columns))


def columns(d: Dense, profile: Profile, onset: float, weights: Array) -> Array:
    """d (M, q) of a fault from ``onset`` on, in a direction over the channels (m,)."""
    one = profile(np.zeros(1))
    out = np.zeros((len(d.time), one.shape[1]))
    after = d.time >= onset
    out[after] = profile(d.time[after] - onset) * weights[d.channel[after], None]
    return out


def candidates(d: Dense, weights: Array) -> Array:
    """The times at which any of the direction's channels was measured (K,)."""
    return np.unique(d.time[weights[d.channel] != 0.0])


@dataclass(frozen=True)
class Fits:
    """The best amplitudes of K faults. What is hidden has ratio, amplitude and se NaN."""

    ratio: Array  # (K,)
    amplitude: Array  # (K, q)
    se: Array  # (K, q)
    first_order: Array  # (K,) g'd, or its norm where q > 1
    first_order_sigma: Array  # (K,) standard deviation of g'd with no fault (q > 1: of its norm)
    detectability: Array  # (K,)


def fits(d: Dense, faults: NDArray[np.float64]) -> Fits:
    """Of faults (K, M, q)."""
    return _of_whitened(d, *_whitened(d, faults))


def _whitened(d: Dense, faults: NDArray[np.float64]) -> tuple[Long, Array]:
    """(M, K, q) by Gamma, and as if the state were known, by R."""
    K, M, q = faults.shape
    flat = faults.transpose(1, 0, 2).reshape(M, K * q)
    seen = np.linalg.solve(np.linalg.cholesky(d.R), flat)
    return d.whiten(flat).reshape(M, K, q), seen.reshape(M, K, q)


def _of_whitened(d: Dense, white: Long, seen: Array) -> Fits:
    G = np.einsum("mki,mkj->kij", white, white).astype(np.float64)
    G_white = np.einsum("mki,mkj->kij", seen, seen)
    num = np.einsum("mki,m->ki", white, d.whiten(d.gamma)).astype(np.float64)
    found = [_fit(*given) for given in zip(num, G, G_white, strict=True)]
    return Fits(*(np.array([getattr(f, field.name)[0] for f in found]) for field in fields(Fits)))


def _fit(num: Array, G: Array, G_white: Array) -> Fits:
    g, share = 2.0 * num, _detectability(G, G_white)
    first = float(g[0]) if len(g) == 1 else float(np.linalg.norm(g))
    deviation = float(2.0 * np.sqrt(np.trace(G)))
    a, se, ratio = np.full(len(num), np.nan), np.full(len(num), np.nan), np.nan
    if share > NOTHING:
        scale = np.sqrt(np.diag(G))  # the amplitudes may have different units
        inverse = np.linalg.inv(G / np.outer(scale, scale)) / np.outer(scale, scale)
        a, se = inverse @ num, np.sqrt(np.diag(inverse))
        ratio = float(num @ a)
    return Fits(*(np.array([v]) for v in (ratio, a, se, first, deviation, share)))


def _detectability(G: Array, G_white: Array) -> float:
    """The smallest share, over all amplitudes, of the information that a known state would give."""
    scale = np.sqrt(np.diag(G_white))
    if not (scale > 0.0).all():
        return 0.0
    unit = np.outer(scale, scale)
    if np.linalg.eigvalsh(G_white / unit)[0] < NOTHING:
        return 0.0  # amplitudes that cannot be told apart even if the state is known
    return float(eigh(G / unit, G_white / unit, eigvals_only=True)[0])


def onset_faults(d: Dense, profile: Profile, weights: Array) -> NDArray[np.float64]:
    """(K, M, q) from every candidate on."""
    return np.array([columns(d, profile, t, weights) for t in candidates(d, weights)])


def onset_fits(d: Dense, profile: Profile, weights: Array) -> Fits:
    return fits(d, onset_faults(d, profile, weights))


def ended(faults: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """d_m - d_m' of every onset m and later end m', and d_m itself, which has no end: (pairs, M, q)
    and the indices (pairs, 2), the end's len(faults) where there is none."""
    index = _pairs(len(faults))
    never = np.concatenate([faults, np.zeros_like(faults[:1])])
    return faults[index[:, 0]] - never[index[:, 1]], index


def ended_fits(d: Dense, faults: NDArray[np.float64]) -> tuple[Fits, NDArray[np.int64]]:
    """Of all those; whitened before the difference is taken, which is quicker."""
    index, parts = _pairs(len(faults)), []
    for white in _whitened(d, faults):
        never = np.concatenate([white, np.zeros_like(white[:, :1])], axis=1)
        parts.append(white[:, index[:, 0]] - never[:, index[:, 1]])
    return _of_whitened(d, *parts), index


def _pairs(K: int) -> NDArray[np.int64]:
    return np.array([(i, j) for i in range(K) for j in range(i + 1, K + 1)])


def sine_faults(d: Dense, frequencies: Array, weights: Array) -> NDArray[np.float64]:
    """(F, M, 2) over the whole window, phases counted from the channel's first time."""
    first = float(candidates(d, weights)[0])
    lasting = weights[d.channel, None]
    return np.array([sine(f)(d.time - first) * lasting for f in frequencies])
