"""Golden values of statsmodels for the prognosis: python make_statsmodels_reference.py OUT

OUT  file that receives one JSON object

A seeded series of 200 values, ARIMA's log-likelihood on it at statsmodels' own optimum for several orders, and LOWESS of it with
gross errors. statsmodels differences the series first (simple_differencing), so that the likelihood is exact.
"""
import json, sys, warnings
import numpy as np
import statsmodels
from statsmodels.nonparametric.smoothers_lowess import lowess
from statsmodels.tsa.statespace.sarimax import SARIMAX

warnings.filterwarnings("ignore")
random = np.random.default_rng(5)
noise, wave = random.normal(size=230), np.zeros(230)
for t in range(3, 230):
    wave[t] = 0.6 * wave[t - 1] + 0.15 * wave[t - 2] - 0.2 * wave[t - 3] + noise[t] + 0.5 * noise[t - 1] - 0.1 * noise[t - 3]
series = np.round(400 + np.cumsum(wave[30:]), 6)
out = dict(made_by=f"statsmodels {statsmodels.__version__}, numpy {np.__version__}", series=series.tolist(), arima=[])
for order in [(3, 1, 3), (1, 1, 0), (0, 1, 1), (2, 1, 2), (4, 1, 1), (1, 2, 2), (2, 0, 1)]:
    p, d, q = order
    centre = float(series.mean()) if d == 0 else 0.0
    model = SARIMAX(series - centre, order=order, trend="n", simple_differencing=True, enforce_stationarity=True, enforce_invertibility=True)
    fit = model.fit(disp=0, maxiter=500)
    ahead = fit.get_forecast(5)
    out["arima"].append(dict(order=order, centre=centre, ar=fit.params[:p].tolist(), ma=fit.params[p:p + q].tolist(), variance=float(fit.params[-1]),
                             log_likelihood=float(fit.llf), aic=float(fit.aic),
                             differenced_forecast=ahead.predicted_mean.tolist(), differenced_sd=ahead.se_mean.tolist()))
x = np.arange(200.0)
dirty = series.copy()
dirty[[20, 21, 90, 150, 199]] += [40, -30, 60, -50, 25]
dirty = np.round(dirty, 6)
out["lowess"] = dict(y=dirty.tolist(), cases=[dict(fraction=f, iterations=n, smooth=lowess(dirty, x, frac=f, it=n, delta=0.0, return_sorted=False).tolist())
                                                for f, n in ((0.15, 3), (0.3, 0), (0.05, 5))])
open(sys.argv[1], "w").write(json.dumps(out) + "\n")
