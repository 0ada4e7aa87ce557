"""Another processor's arithmetic on this one: what is sealed must not depend on last digits."""

import numpy as np

NOISE = 1e-15  # relative: some five units in the last place, more than any two mathematical libraries differ by


def make_noisy():
    """From now on every function whose last digits differ between libraries errs by the noise."""
    rng = np.random.default_rng(20)

    def noisy(exact):
        def function(*arguments, **options):
            value = exact(*arguments, **options)
            return value * (1.0 + NOISE * rng.uniform(-1.0, 1.0, np.shape(value)))
        return function

    for name in ("sin", "cos", "arctan2", "arcsin", "exp", "expm1", "log"):
        setattr(np, name, noisy(getattr(np, name)))
    for name in ("norm", "solve", "inv", "cholesky"):
        setattr(np.linalg, name, noisy(getattr(np.linalg, name)))
