"""What ``import-rotor`` answers."""

from dataclasses import dataclass

from ..inputs import Rotor
from ..record import Answer


@dataclass(frozen=True, eq=False, repr=False)
class ImportedRotor(Answer):
    """A drawing from a rotor of ROSS, what was carried over and what was left, a sentence each."""

    rotor: Rotor
    carried: tuple[str, ...]
    left: tuple[str, ...]
