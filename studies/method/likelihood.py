"""Two curves with two parameters each, fitted to counts: a straight line, and a logistic one."""

from typing import Final

import numpy as np

from studies.method.curve import Float

_ITERATIONS: Final = 20_000
"""The largest number of steps of expectation and maximisation."""
_STEEPEST: Final = 60.0
"""The bound of the logistic curve's exponent; beyond it the curve is a step anyway."""


def deviance(hits: Float, trials: Float, rates: Float) -> float:
    r"""Twice the log-likelihood that `rates` miss against the measured shares.

    $$ 2 \sum_i k_i \ln \frac{k_i}{n_i p_i} + (n_i - k_i) \ln \frac{n_i - k_i}{n_i (1 - p_i)} $$

    McCullagh and Nelder, Generalized Linear Models, 1989, section 4.4.

    Args:
        hits: counts k, shape (points,).
        trials: counts n, shape (points,).
        rates: the curve p, from 0 to 1, shape (points,).
    """
    missed = _part(hits, trials * rates) + _part(trials - hits, trials * (1.0 - rates))
    return 2.0 * float(missed.sum())


def straight(position: Float, hits: Float, trials: Float) -> Float:
    """The straight line of largest likelihood with rates from 0 to 1.

    At position x the rate (1 - x) a + x b is that of a mixture of two coins with known weights; its
    likelihood is maximised by expectation and maximisation (Dempster, Laird and Rubin, JRSS B
    39(1), 1977), which never leaves 0 to 1. It is concave: there is one maximum.

    Args:
        position: where the counts were made, from 0 to 1, both of which occur, shape (points,).
        hits: counts of successes, shape (points,).
        trials: counts of all, shape (points,).

    Returns:
        The rates of the line, 0 to 1, at `position`, shape (points,).
    """
    ends = np.array([0.25, 0.75])
    weights = np.stack([1.0 - position, position])
    for _ in range(_ITERATIONS):
        rates = ends @ weights
        successes = hits * _share(weights * ends[:, None], rates)
        failures = (trials - hits) * _share(weights * (1.0 - ends)[:, None], 1.0 - rates)
        total = successes.sum(axis=1) + failures.sum(axis=1)
        following = successes.sum(axis=1) / total
        if np.abs(following - ends).max() < 1e-13:
            break
        ends = following
    line: Float = np.clip(ends @ weights, 0.0, 1.0)
    return line


def logistic(position: Float, hits: Float, trials: Float) -> Float:
    """The logistic curve of largest likelihood, by Newton's method.

    McCullagh and Nelder, section 4.4.2. Where the counts are separated, the likelihood has no
    maximum; the curve is then a step, as steep as makes no difference.

    Args:
        position: where the counts were made, in any unit, shape (points,).
        hits: counts of successes, shape (points,).
        trials: counts of all, shape (points,).

    Returns:
        The rates of the curve, 0 to 1, at `position`, shape (points,).
    """
    design = np.stack([np.ones_like(position), position], axis=1)
    chosen = np.zeros(2)
    best = deviance(hits, trials, _sigmoid(design @ chosen))
    for _ in range(200):
        rates = _sigmoid(design @ chosen)
        slope = design.T @ (hits - trials * rates)
        curvature = design.T @ (design * (trials * rates * (1.0 - rates))[:, None])
        step = np.linalg.solve(curvature + 1e-9 * np.eye(2), slope)
        scale = 1.0
        while scale > 1e-6:  # halve a step that does not improve
            candidate = chosen + scale * step
            missed = deviance(hits, trials, _sigmoid(design @ candidate))
            if missed <= best:
                break
            scale /= 2.0
        if scale <= 1e-6 or best - missed < 1e-12:
            break
        chosen, best = candidate, missed
    return _sigmoid(design @ chosen)


def _sigmoid(x: Float) -> Float:
    found: Float = 1.0 / (1.0 + np.exp(-np.clip(x, -_STEEPEST, _STEEPEST)))
    return found


def _share(parts: Float, whole: Float) -> Float:
    found: Float = parts / np.where(whole > 0.0, whole, 1.0)
    return found


def _part(observed: Float, expected: Float) -> Float:
    """`k ln(k / e)`, 0 where nothing was observed; a curve that excludes it misses infinitely."""
    is_there = observed > 0.0
    counted, wanted = np.where(is_there, observed, 1.0), np.where(is_there, expected, 1.0)
    with np.errstate(divide="ignore"):
        found: Float = observed * (np.log(counted) - np.log(wanted))
    return found
