"""An STM32G474 and the NUCLEO board around it, at register level, in virtual time; see ../README.md."""

from .board import Nucleo
from .canbus import VirtualTimeBus
from .wire import Adapter, Babbler, Frame, Wire

__all__ = ["Adapter", "Babbler", "Frame", "Nucleo", "VirtualTimeBus", "Wire"]
