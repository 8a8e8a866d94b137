#!/usr/bin/env python3
"""Writes an image (ELF) as Intel HEX without the settings' sectors: image-hex.py IMAGE HEX.

The file has data records for the bytes of the image only, so that a programmer which erases the sectors it writes (the ST-Link's drive, probe-rs)
leaves the settings alone. An image whose segments reach into the settings' sectors, by padding between vectors and code too, is refused: probe-rs
would erase the settings when it flashes the ELF. The written file is read back and compared with the image.
"""

import struct
import sys

LOADED = 1  # type of a segment (ELF specification 1.2)
# Sectors 1 and 2 of the STM32F446 (RM0390 table 5), which firmware/src/bin/stand/flash.rs uses and memory.x keeps free.
SETTINGS = range(0x0800_4000, 0x0800_C000)
FLASH = range(0x0800_0000, 0x0808_0000)
RECORD_BYTES = 16
DATA, END, LINEAR_ADDRESS, START_ADDRESS = 0, 1, 4, 5


class ImageError(Exception):
    """The image cannot be written as HEX, or the HEX is damaged."""


def image_bytes(elf):
    """Each byte of the loadable segments by its load address, and the entry point of a 32-bit little-endian ELF."""
    if elf[:6] != b"\x7fELF\x01\x01":
        raise ImageError("not a 32-bit little-endian ELF")
    entry, segments_at = struct.unpack_from("<2I", elf, 24)
    size, count = struct.unpack_from("<2H", elf, 42)
    found = {}
    for n in range(count):
        kind, offset, _, load, length = struct.unpack_from("<5I", elf, segments_at + n * size)
        if kind != LOADED:
            continue
        for address, byte in enumerate(elf[offset : offset + length], load):
            if address not in FLASH:
                raise ImageError(f"{address:#010x} is not in the flash")
            if address in SETTINGS:
                raise ImageError(f"{address:#010x} is in the sectors of the settings: see memory.x")
            if address in found:
                raise ImageError(f"{address:#010x} has two values")
            found[address] = byte
    if not found:
        raise ImageError("the image has no bytes to load")
    return found, entry


def record(kind, address, data):
    """A line: length, address, type, data, checksum."""
    body = struct.pack(">BHB", len(data), address, kind) + data
    return ":" + (body + bytes([-sum(body) & 0xFF])).hex().upper() + "\n"


def to_hex(found, entry):
    """The text of the HEX file."""
    lines, upper = [], None
    addresses = sorted(found)
    n = 0
    while n < len(addresses):
        begin = addresses[n]
        if begin >> 16 != upper:
            upper = begin >> 16
            lines.append(record(LINEAR_ADDRESS, 0, struct.pack(">H", upper)))
        data = bytearray()
        # Records begin at multiples of their length and do not cross them.
        while n < len(addresses) and addresses[n] == begin + len(data) and (not data or addresses[n] % RECORD_BYTES):
            data.append(found[addresses[n]])
            n += 1
        lines.append(record(DATA, begin & 0xFFFF, bytes(data)))
    lines.append(record(START_ADDRESS, 0, struct.pack(">I", entry)))
    lines.append(record(END, 0, b""))
    return "".join(lines)


def from_hex(text):
    """Each byte by its address, and the entry point of a HEX file."""
    found, entry, upper, ended = {}, None, 0, False
    for number, line in enumerate(text.splitlines(), 1):
        try:
            body = bytes.fromhex(line[1:])
        except ValueError:
            body = b""
        if line[:1] != ":" or len(body) < 5 or len(body) != body[0] + 5 or ended:
            raise ImageError(f"line {number} is not a record")
        if sum(body) & 0xFF:
            raise ImageError(f"line {number}: the checksum is wrong")
        address, kind, data = body[1] << 8 | body[2], body[3], body[4:-1]
        if kind == DATA:
            for n, byte in enumerate(data):
                if upper + address + n in found:
                    raise ImageError(f"line {number}: {upper + address + n:#010x} has two values")
                found[upper + address + n] = byte
        elif kind == LINEAR_ADDRESS:
            upper = int.from_bytes(data, "big") << 16
        elif kind == START_ADDRESS:
            entry = int.from_bytes(data, "big")
        elif kind == END:
            ended = True
        else:
            raise ImageError(f"line {number}: type {kind}")
    if not ended:
        raise ImageError("the end record is missing")
    return found, entry


def main():
    image, output = sys.argv[1:3]
    with open(image, "rb") as file:
        elf = file.read()
    try:
        found, entry = image_bytes(elf)
        with open(output, "w", encoding="ascii", newline="\n") as file:
            file.write(to_hex(found, entry))
        with open(output, encoding="ascii") as file:
            if from_hex(file.read()) != (found, entry):
                raise ImageError("the written file differs from the image")
    except ImageError as error:
        sys.exit(f"{image}: {error}")
    print(f"{output}: {len(found)} bytes, none in the settings' sectors {SETTINGS.start:#010x} to {SETTINGS.stop - 1:#010x}")


if __name__ == "__main__":
    main()
