"""Intervals and calibration, from the standard library alone."""

import math


def binomial_tail(successes, trials, rate):
    """P(K >= successes)."""
    if successes <= 0:
        return 1.0
    if rate <= 0.0:
        return 0.0
    if rate >= 1.0:
        return 1.0
    log = [math.lgamma(trials + 1) - math.lgamma(k + 1) - math.lgamma(trials - k + 1) + k * math.log(rate)
           + (trials - k) * math.log1p(-rate) for k in range(successes, trials + 1)]
    return min(1.0, sum(math.exp(v) for v in log))


def clopper_pearson(successes, trials, level=0.95):
    """Exact interval of a rate (C. J. Clopper, E. S. Pearson, Biometrika 26, 1934)."""
    if trials == 0:
        return 0.0, 1.0
    half = (1.0 - level) / 2.0

    def solve(inside):
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if inside(middle) else (low, middle)
        return 0.5 * (low + high)

    lower = 0.0 if successes == 0 else solve(lambda r: binomial_tail(successes, trials, r) < half)
    upper = 1.0 if successes == trials else solve(lambda r: 1.0 - binomial_tail(successes + 1, trials, r) > half)
    return lower, upper


def misses(successes, trials, goal, at_least=True, risk=0.01):
    """True when a program that meets the goal would do as badly as this by chance in less than `risk` of all runs."""
    if at_least:
        return 1.0 - binomial_tail(successes + 1, trials, goal) < risk
    return binomial_tail(successes, trials, goal) < risk


def calibration_error(pairs, bins=10):
    """Expected calibration error of (stated confidence, right or not) in bins of equal counts, and the Brier score."""
    pairs = sorted(pairs)
    if not pairs:
        return float("nan"), float("nan")
    size = max(1, math.ceil(len(pairs) / bins))
    error = 0.0
    for start in range(0, len(pairs), size):
        part = pairs[start : start + size]
        error += abs(sum(c for c, _ in part) - sum(r for _, r in part))
    return error / len(pairs), sum((c - r) ** 2 for c, r in pairs) / len(pairs)


def f_tail(value, k, m):
    """P(F > value) with k and m degrees of freedom: the regularised incomplete beta function by its continued fraction (Lentz)."""
    a, b, x = 0.5 * m, 0.5 * k, m / (m + k * max(value, 0.0))
    if x >= 1.0:
        return 1.0
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - _beta(b, a, 1.0 - x)
    return _beta(a, b, x)


def _beta(a, b, x):
    if x <= 0.0:
        return 0.0
    front = math.exp(math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)) / a
    tiny = 1e-300
    c, d = 1.0, 1.0 / (1.0 - (a + b) * x / (a + 1.0) or tiny)
    fraction = d
    for k in range(1, 2000):
        for factor in (k * (b - k) * x / ((a + 2 * k - 1) * (a + 2 * k)), -(a + k) * (a + b + k) * x / ((a + 2 * k) * (a + 2 * k + 1))):
            d = 1.0 / (1.0 + factor * d or tiny)
            c = 1.0 + factor / c or tiny
            fraction *= c * d
        if abs(c * d - 1.0) < 1e-15:
            break
    return front * fraction


def chi2_tail(value, dof):
    """P(chi-square > value): the regularised incomplete gamma function by its series, or by its continued fraction (Lentz)."""
    a, x = 0.5 * dof, 0.5 * value
    if x <= 0.0:
        return 1.0
    front = math.exp(a * math.log(x) - x - math.lgamma(a))
    if x < a + 1.0:
        term = total = 1.0 / a
        for k in range(1, 2000):
            term *= x / (a + k)
            total += term
            if term < 1e-15 * total:
                break
        return max(0.0, 1.0 - front * total)
    tiny = 1e-300
    b = x + 1.0 - a
    c, d = 1.0 / tiny, 1.0 / b
    fraction = d
    for k in range(1, 2000):
        factor = -k * (k - a)
        b += 2.0
        d = 1.0 / (factor * d + b or tiny)
        c = b + factor / c or tiny
        fraction *= c * d
        if abs(c * d - 1.0) < 1e-15:
            break
    return min(1.0, front * fraction)
