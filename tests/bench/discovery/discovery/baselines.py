"""What common practice would have said of the same data: forward AIC, forward BIC, LASSO with cross-validation.

All get the whitened data with set-up and base model projected out, every period and lag of a grid, and the choice of the best variant:
more than a user of such a package would have. The noise variance is estimated, as those packages do.
"""

import math

import numpy as np


def forward(data, bases, penalty, most=3):
    """Names in the order in which the criterion takes them."""
    count, rest, spanned, chosen = len(data), data, np.zeros((len(data), 0)), []
    score, used = count * math.log(rest @ rest / count), 0
    while len(chosen) < most:
        gains = [(float(np.sum((basis.T @ rest) ** 2)), k) for k, (_, _, basis) in enumerate(bases)]
        left = rest @ rest
        scored = [(count * math.log(max(left - g, 1e-9) / count) + penalty * (used + bases[k][2].shape[1]), k) for g, k in gains]
        best, k = min(scored)
        if best >= score:
            break
        name, _, basis = bases[k]
        fresh = basis - spanned @ (spanned.T @ basis)
        u, s, _ = np.linalg.svd(fresh, full_matrices=False)
        spanned = np.concatenate([spanned, u[:, s > 1e-6]], axis=1)
        rest = data - spanned @ (spanned.T @ data)
        chosen.append(name)
        used += basis.shape[1]
        score = count * math.log(rest @ rest / count) + penalty * used
    return chosen


def shrink(gram, moment, weights, steps=150):
    """Accelerated proximal gradient for 1/2 b'Gb - m'b + w|b|_1, for all weights at once."""
    bound = np.linalg.norm(gram, 2)
    b = np.zeros((gram.shape[0], len(weights)))
    y, t = b, 1.0
    for _ in range(steps):
        z = y - (gram @ y - moment[:, None]) / bound
        fresh = np.sign(z) * np.maximum(np.abs(z) - weights / bound, 0.0)
        t_next = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * t * t))
        y = fresh + (t - 1.0) / t_next * (fresh - b)
        b, t = fresh, t_next
    return b


def lasso(data, bases, rng, folds=5):
    """Names by the size of what LASSO keeps, its weight by cross-validation over readings."""
    best = {}
    for name, _, basis in bases:
        gain = float(np.sum((basis.T @ data) ** 2)) / basis.shape[1]
        if name not in best or gain > best[name][0]:
            best[name] = (gain, basis)
    owners = [name for name, (_, basis) in best.items() for _ in range(basis.shape[1])]
    columns = np.concatenate([basis for _, basis in best.values()], axis=1)
    weights = np.abs(columns.T @ data).max() * np.geomspace(1.0, 0.05, 20)
    fold = rng.permutation(len(data)) % folds
    loss = np.zeros(len(weights))
    for k in range(folds):
        train, test = fold != k, fold == k
        x = columns[train]
        b = shrink(x.T @ x, x.T @ data[train], weights * (folds - 1) / folds)
        loss += np.sum((data[test][:, None] - columns[test] @ b) ** 2, axis=0)
    # From below: with no column at all the loss is that of the data.
    if loss.min() >= data @ data:
        return []
    b = shrink(columns.T @ columns, columns.T @ data, weights[[int(np.argmin(loss))]])[:, 0]
    size = {}
    for owner, value in zip(owners, b):
        size[owner] = size.get(owner, 0.0) + value * value
    kept = [(v, k) for k, v in size.items() if v > 1e-8]
    return [k for _, k in sorted(kept, reverse=True)]


def answers(oracle, values, rng):
    data = oracle.project(values[oracle.use])
    bases = oracle.bases()
    return {"AIC": forward(data, bases, 2.0), "BIC": forward(data, bases, math.log(len(data))), "LASSO": lasso(data, bases, rng)}
