"""Answer of ``extract``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/extract.rs``."""

from dataclasses import dataclass, field

from ..inputs import Measurement
from ..record import Answer, Array, Record


@dataclass(frozen=True, eq=False)
class ExtractedKeyphasor(Record):
    """The channel of the phase reference."""

    channel: str
    threshold: float
    """Where the channel was passed, in its unit."""
    missed_pulses: int
    missing_teeth: int
    """Teeth of a wheel that are missing in every turn; t = 0 is then at the pulse after the gap."""
    extra_marks: int
    """Marks that were left out: they came between two turns, or within the hold-off."""
    filled_marks: int
    """Marks that did not come and were put in between those beside them."""
    smoothed: bool
    """Whether a curve was laid through marks that are known to one sample only."""
    samples_per_turn: int | None
    """Samples of a turn, where these follow the shaft's angle and there is no keyphasor."""
    reference_lost_s: float | None
    """From when on nobody knows which pulse of a tacho is which."""


@dataclass(frozen=True, eq=False)
class ExtractedChannel(Record):
    """A probe and the channel that it was read from."""

    probe: str
    channel: str


@dataclass(frozen=True, eq=False)
class Loss(Record):
    """Windows that are lost for one reason; of one probe, or of all."""

    why: str
    probe: str | None
    windows: int
    first_s: float


@dataclass(frozen=True, eq=False)
class Drifted(Record):
    """Windows that are lost because the speed changed too much within them."""

    windows: int
    in_all: int
    largest: float
    """The largest change within a window, relative."""


@dataclass(frozen=True, eq=False)
class Compensated(Record):
    """What the change of speed did to the response, taken off."""

    bins: int
    left: int
    """Bins that are as they were measured."""
    largest_um: float
    at_rpm: float


@dataclass(frozen=True, eq=False)
class ExtractedFile(Record):
    """What one file of samples held."""

    file: str
    run: str | None
    rate_hz: float
    duration_s: float
    keyphasor: ExtractedKeyphasor
    channels: tuple[ExtractedChannel, ...]
    count: float
    """A count of the core's converter in the channels' unit."""
    readings: int
    losses: tuple[Loss, ...]
    drifted: Drifted | None
    compensated: Compensated | None
    doubts: tuple[str, ...]
    """Why the speed may be another, in sentences."""


@dataclass(frozen=True, eq=False, repr=False)
class Extraction(Answer):
    """1x readings from raw samples, by the controller's own extraction."""

    measured: str
    two_x: str | None
    readings: int
    speeds: Array
    """Speed of each reading in the order of its file, rpm."""
    lost: int
    files: tuple[ExtractedFile, ...]
    measurement: Measurement = field(kw_only=True)
    """The readings."""
    measurement_2x: Measurement | None = field(kw_only=True)
    """The vectors at twice the running speed, if they were wanted."""
