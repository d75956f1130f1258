"""R-hat and effective sample sizes by ArviZ: python make_convergence_reference.py > arviz.json

Needs arviz-stats 0.8.0. The chains are made from integers, so that both sides have the same ones to the bit: a linear congruential
generator x' = (16807 x) mod (2^31 - 1), x / (2^31 - 1) in each chain turned into an autoregression a' = rho a + u - 0.5 that begins at 0,
plus a level; each value is rounded to six decimals, of the last case to one, so that it has ties.
"""
import json

import numpy as np
from arviz_stats.base import array_stats

CASES = [dict(seed=1, rho=0.0, levels=[0, 0, 0, 0], length=250, decimals=6), dict(seed=2, rho=0.7, levels=[0, 0, 0, 0], length=300, decimals=6),
         dict(seed=3, rho=-0.4, levels=[0, 0, 0, 0], length=302, decimals=6), dict(seed=4, rho=0.5, levels=[0, 0, 0.15, 0], length=200, decimals=6),
         dict(seed=5, rho=0.9, levels=[0, 0.1, 0, 0], length=500, decimals=1)]


def chains(seed, rho, levels, length, decimals):
    x, all_chains = seed, []
    for level in levels:
        a, chain = 0.0, []
        for _ in range(length):
            x = 16807 * x % 2147483647
            a = rho * a + x / 2147483647 - 0.5
            chain.append(round(level + a, decimals))
        all_chains.append(chain)
    return np.array(all_chains)


def figures(case):
    c = chains(**case)
    stat = lambda f, **more: float(f(c, chain_axis=0, draw_axis=1, **more))
    return dict(case, r_hat=stat(array_stats.rhat, method="rank"), effective_bulk=stat(array_stats.ess, method="bulk"),
                effective_tail=stat(array_stats.ess, method="tail", prob=(0.05, 0.95)))


print(json.dumps([figures(case) for case in CASES], indent=1))
