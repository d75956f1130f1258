"""Answer of ``forecast``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/forecast.rs``."""

from dataclasses import dataclass
from typing import Any

from ..record import Answer, Array, Record

ByHorizon = dict[str, float | None]
"""A figure by the days ahead."""
BySeries = dict[str, ByHorizon]
"""The same by series: U_g and U_d are static and dynamic unbalance, g·mm, alpha_g and alpha_d their angles, degrees."""


@dataclass(frozen=True, eq=False)
class LimitDays(Record):
    """Days until the limit is reached with a chance of 5 to 95 %; None is not within the forecast."""

    p5: float | None
    p10: float | None
    p50: float | None
    p90: float | None
    p95: float | None


@dataclass(frozen=True, eq=False)
class Limit(Record):
    """When the static unbalance reaches a limit."""

    limit_g_mm: float
    now_g_mm: float
    exceeded: bool
    chance: float
    chance_until: Array
    """Chance that it is reached by each day ahead."""
    days: LimitDays


@dataclass(frozen=True, eq=False, repr=False)
class Forecast(Answer):
    """Where the unbalance is going, and what became of forecasts of the past."""

    model: str
    rmse: BySeries
    baselines: dict[str, BySeries]
    coverage_95: BySeries
    compared: BySeries
    scores: dict[str, dict[str, dict[str, dict[str, Any]]]]
    """By model, series and days ahead: rmse, crps, pinball, coverage_95, compared."""
    against_naive: tuple[str, ...]
    forecast: tuple[dict[str, Any], ...]
    """A day each: time_d, time (ISO 8601, if known), and value, low and high (95 %) of every series."""
    event_chance: float | None
    """Chance of an event, which would end the forecast, within its days; None where the track does not say."""
    limit: Limit | None
