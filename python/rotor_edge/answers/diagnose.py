"""Answers of ``diagnose``, ``add`` and ``improve``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/diagnose.rs``."""

from dataclasses import dataclass, field
from typing import Any

from ..inputs import Rotor
from ..record import Answer, Record
from .dimensions import Dimension
from .findings import Determined, Noise, RefutedRun, UnknownCause
from .identify import Departure, IdentifiedCoefficient

Parameters = dict[str, Any]
"""Values by name; a phasor is its real and imaginary part."""


@dataclass(frozen=True, eq=False)
class Candidate(Record):
    """An effect at a place, as the data would have it."""

    effect: str
    at: str | None
    probability: float
    delta_bic: float
    """The old name of ``twice_log_bayes_factor``."""
    twice_log_bayes_factor: float
    """Twice the logarithm of the Bayes factor over the model alone."""
    error_after: float
    chi2_per_value: float
    parameters: Parameters
    uncertainty: Parameters
    uncertainty_kind: str
    """What ``uncertainty`` is: one standard deviation."""
    interval_95: Parameters
    """Least and most of each number; they hold where ``model_adequate``."""
    model_adequate: bool
    """Whether the model with the effect describes the data."""
    units: dict[str, str] | None
    disqualified: str | None
    """Why physics rules it out."""
    explanation: str


@dataclass(frozen=True, eq=False)
class HeldOut(Record):
    """χ² per value at speeds that were left out, without and with the effect."""

    before: float
    after: float


@dataclass(frozen=True, eq=False)
class Advice(Record):
    """A measurement that would tell rivals apart."""

    measurement: str
    separation_sd: float
    speed_rpm: float
    repeats: int


@dataclass(frozen=True, eq=False)
class Mistake(Record):
    """A mistake in the rotor's file or the measurement that explains the misfit better than any effect."""

    words: str
    """What is probably wrong."""
    probability: float | None
    """None where the size of the numbers alone shows it."""
    chi2_per_value: float | None
    """Of the model without the mistake, where that was fitted."""


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Answer):
    """Which effect is missing; ``verdict`` is adequate, not_determined, missing, undecided or unknown."""

    verdict: str
    summary: str
    error_before: float
    chi2_per_value: float
    nothing_missing: float
    candidates: tuple[Candidate, ...]
    indistinguishable: tuple[tuple[str, ...], ...]
    held_out: HeldOut | None
    advice: tuple[Advice, ...]
    remarks: tuple[str, ...]
    noise: Noise
    determined: Determined
    bearings: tuple[IdentifiedCoefficient, ...]
    """As fitted."""
    dimensions: tuple[Dimension, ...]
    """The drawing as fitted; none of an exact one."""
    unknown: UnknownCause | None
    refuted_runs: tuple[RefutedRun, ...]
    not_as_stated: tuple[Departure, ...]
    """Numbers of bearings that are not as stated, where the model is adequate."""
    bad_probe: str | None
    """Name of the probe that does not show what the others do, where the summary says so of one."""
    mistake: Mistake | None
    """The mistake in the rotor's file or the measurement that the summary names."""
    together: tuple[str, ...]
    """The effects that explain the data only together, where the summary names some."""


@dataclass(frozen=True, eq=False, repr=False)
class Addition(Answer):
    """A model with an effect more."""

    error_before: float
    error_after: float
    chi2_per_value_before: float
    chi2_per_value_after: float
    parameters: Parameters
    uncertainty: Parameters
    uncertainty_kind: str
    """What ``uncertainty`` is: one standard deviation."""
    interval_95: Parameters
    """Least and most of each number; they hold where ``model_adequate``."""
    model_adequate: bool
    """Whether the model with the effect describes the data."""
    units: dict[str, str]
    bearings: tuple[IdentifiedCoefficient, ...]
    """As fitted together with the effect."""
    dimensions: tuple[Dimension, ...]
    """The drawing as fitted together with the effect; none of an exact one."""
    disqualified: str | None
    rotor: Rotor = field(kw_only=True)
    """The better model."""


@dataclass(frozen=True, eq=False)
class Step(Record):
    """An effect that was added."""

    effect: str
    at: str | None
    error_after: float
    chi2_per_value: float
    group: tuple[str, ...]
    """Sets of effects that explain the data as well."""
    parameters: Parameters
    uncertainty: Parameters
    uncertainty_kind: str
    """What ``uncertainty`` is: one standard deviation."""
    interval_95: Parameters
    """Least and most of each number; they hold where ``model_adequate``."""
    model_adequate: bool
    """Whether the model with the effect describes the data."""


@dataclass(frozen=True, eq=False, repr=False)
class Improvement(Answer):
    """A model with all the effects that the data ask for; verdicts are those of a diagnosis."""

    error_before: float
    chi2_per_value_before: float
    steps: tuple[Step, ...]
    verdict: str
    summary: str
    noise: Noise
    determined: Determined
    bearings: tuple[IdentifiedCoefficient, ...]
    """As fitted, with all effects."""
    dimensions: tuple[Dimension, ...]
    """The drawing as fitted, with all effects; none of an exact one."""
    unknown: UnknownCause | None
    refuted_runs: tuple[RefutedRun, ...]
    not_as_stated: tuple[Departure, ...]
    """Numbers of bearings that are not as stated, where the model is adequate."""
    remarks: tuple[str, ...]
    mistake: Mistake | None
    """The mistake in the files for which no effect was added."""
    written: bool
    """Whether the model was written; one that lacks an unknown cause or holds a mistake only if asked."""
    rotor: Rotor | None = field(kw_only=True)
    """The better model; None if it was not written."""
