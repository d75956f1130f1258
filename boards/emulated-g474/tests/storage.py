"""What the firmware stores at the end of the second bank, as boards/common describes it, made and taken apart in Python."""

import binascii
import struct

from g474.flash import BANK_2, BANK_BYTES

HEAD_BYTES, ALIGNMENT = 32, 32
MARK, OLD_MARK = b"REs2", b"REs1"


def slot(number, counter, model, thresholds=b""):
    """A slot's bytes."""
    crc = binascii.crc32
    head = MARK + struct.pack("<IQHHII", number, counter, len(model), len(thresholds), crc(model), crc(thresholds))
    padding = b"\xff" * (-len(model) % ALIGNMENT)
    return head + struct.pack("<I", crc(head)) + model + (padding + thresholds if thresholds else b"")


def old_slot(number, counter, model):
    """A slot as the firmware before stored it."""
    head = OLD_MARK + struct.pack("<IQIII", number, counter, len(model), 0, 0)
    return head + struct.pack("<I", binascii.crc32(head + bytes(4) + model)) + model


def find(flash, mark):
    """Addresses in the second bank where a mark lies at the beginning of a double word."""
    bank = flash.banks[1]
    return [BANK_2 + place for place in range(0, BANK_BYTES, 8) if bank[place : place + 4] == mark]


def model_of(flash, address):
    """The model's bytes in a slot."""
    place = address - BANK_2
    (length,) = struct.unpack_from("<H", flash.banks[1], place + 16)
    return bytes(flash.banks[1][place + HEAD_BYTES : place + HEAD_BYTES + length])


def put(flash, address, data):
    """Writes without taking time; what was there is gone."""
    place = address - BANK_2
    data = data + b"\xff" * (-len(data) % 8)
    flash.banks[1][place : place + len(data)] = data
