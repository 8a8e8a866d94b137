#!/usr/bin/env python3
"""Checks flash and static RAM of an image (ELF) against a budget: image-size.py IMAGE BUDGET."""

import struct
import sys
import tomllib

ALLOCATED, NO_BITS = 0x2, 8


def sections(data):
    """Name, type, flags, address and size of each section of a 32-bit little-endian ELF."""
    if data[:6] != b"\x7fELF\x01\x01":
        sys.exit("not a 32-bit little-endian ELF")
    start, = struct.unpack_from("<I", data, 32)
    entry, count, names_at = struct.unpack_from("<3H", data, 46)
    headers = [struct.unpack_from("<10I", data, start + n * entry) for n in range(count)]
    names = headers[names_at][4]
    for name, kind, flags, address, _, size, *_ in headers:
        begin = names + name
        yield data[begin : data.index(b"\0", begin)].decode(), kind, flags, address, size


def main():
    image, budget_file = sys.argv[1:3]
    with open(image, "rb") as file:
        data = file.read()
    with open(budget_file, "rb") as file:
        budget = tomllib.load(file)
    used = {"flash": 0, "ram": 0}
    for name, kind, flags, address, size in sections(data):
        if not flags & ALLOCATED or not size:
            continue
        in_ram = address >= 0x2000_0000
        if in_ram:
            used["ram"] += size
        if kind != NO_BITS:  # initialised data in RAM also occupies flash
            used["flash"] += size
        print(f"{name:<20}{address:#12x}{size:>9} B")
    over = False
    for memory, key in ("flash", "image_bytes"), ("ram", "static_ram_bytes"):
        size, limit = used[memory], budget[key]
        print(f"{memory:<6}{size:>9} B of {limit} B budgeted ({100 * size / limit:.0f} %)")
        over |= size > limit
    if over:
        sys.exit("the image is larger than firmware/budget.toml allows")


main()
