#!/usr/bin/env python3
"""Tests of image-hex.py: image_hex_test.py [IMAGE HEX]; with an image and its HEX file also these are compared."""

import importlib.util
import pathlib
import struct
import sys
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parent
SPEC = importlib.util.spec_from_file_location("image_hex", SCRIPTS / "image-hex.py")
image_hex = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(image_hex)


def elf(parts, entry=0x0800_C001):
    """An ELF with a segment for each (address, bytes), and one without bytes in the file, as .bss has it."""
    at, head, data = 52 + 32 * (len(parts) + 1), b"", b""
    for address, part in parts:
        head += struct.pack("<8I", image_hex.LOADED, at + len(data), 0x2000_0000, address, len(part), len(part), 4, 4)
        data += part
    head += struct.pack("<8I", image_hex.LOADED, at, 0x2000_0000, 0x2000_0000, 0, 64, 6, 4)
    header = struct.pack("<2H5I6H", 2, 40, 1, entry, 52, 0, 0, 52, 32, len(parts) + 1, 40, 0, 0)
    return b"\x7fELF\x01\x01\x01".ljust(16, b"\0") + header + head + data


def loadable_bytes(data):
    """The bytes of the loadable segments by load address, read apart from image-hex.py."""
    segments_at, = struct.unpack_from("<I", data, 28)
    size, count = struct.unpack_from("<2H", data, 42)
    found = {}
    for n in range(count):
        kind, at, _, load, length = struct.unpack_from("<5I", data, segments_at + n * size)
        if kind == 1:
            found.update(enumerate(data[at : at + length], load))
    return found


PARTS = [(0x0800_0000, bytes(range(200)) * 2), (0x0800_C000, b"code" * 9001), (0x0800_C000 + 4 * 9001 + 3, b"odd")]


class Hex(unittest.TestCase):
    def text(self, parts=None):
        return image_hex.to_hex(*image_hex.image_bytes(elf(parts or PARTS)))

    def test_the_file_reads_back_as_the_loadable_segments(self):
        data = elf(PARTS)
        found, entry = image_hex.from_hex(self.text())
        self.assertEqual(found, loadable_bytes(data))
        self.assertEqual((entry, len(found)), (0x0800_C001, 400 + 36_004 + 3))
        self.assertFalse(any(address in image_hex.SETTINGS for address in found))

    def test_records_are_those_of_the_specification(self):
        # Example of Intel's specification (1988): 16 bytes at 0x0100.
        line = ":10010000214601360121470136007EFE09D2190140\n"
        self.assertEqual(image_hex.record(0, 0x0100, bytes.fromhex("214601360121470136007EFE09D21901")), line)
        self.assertTrue(self.text().startswith(":020000040800F2\n:10000000000102"))
        self.assertTrue(self.text().endswith(":040000050800C0012E\n:00000001FF\n"))

    def test_a_byte_in_the_settings_sectors_is_refused(self):
        for address in 0x0800_4000, 0x0800_BFFF, 0x0800_3FFF:
            with self.assertRaisesRegex(image_hex.ImageError, "sectors of the settings"):
                self.text([(address, b"xy")])

    def test_padding_from_the_vectors_to_the_code_is_refused(self):
        with self.assertRaisesRegex(image_hex.ImageError, "0x08004000 is in the sectors of the settings"):
            self.text([(0x0800_0000, bytes(0xC000) + b"code")])

    def test_overlapping_segments_are_refused(self):
        with self.assertRaisesRegex(image_hex.ImageError, "0x0800c001 has two values"):
            self.text([(0x0800_C000, b"co"), (0x0800_C001, b"x")])

    def test_a_damaged_file_is_detected(self):
        text = self.text()
        for damaged, error in [
            (text.replace(":1000000000", ":1000000001", 1), "line 2: the checksum"),
            (text[: text.rindex(":")], "end record"),
            (text.replace(":10", ":0F", 1), "line 2 is not a record"),
            (text.replace(":", ";", 1), "line 1 is not a record"),
        ]:
            with self.assertRaisesRegex(image_hex.ImageError, error):
                image_hex.from_hex(damaged)

    def test_another_file_is_refused(self):
        for data in b"", b"\x7fELF\x02\x01" + bytes(60):
            with self.assertRaisesRegex(image_hex.ImageError, "not a 32-bit"):
                image_hex.image_bytes(data)
        with self.assertRaisesRegex(image_hex.ImageError, "not in the flash"):
            self.text([(0x2000_0000, b"ram")])

    @unittest.skipIf(len(sys.argv) < 3, "no image given")
    def test_the_file_of_the_image_is_the_image(self):
        with open(sys.argv[1], "rb") as file:
            segments = loadable_bytes(file.read())
        with open(sys.argv[2], encoding="ascii") as file:
            found, _ = image_hex.from_hex(file.read())
        self.assertEqual(found, segments)
        self.assertFalse(any(address in image_hex.SETTINGS for address in found))
        self.assertIn(0x0800_0000, found)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
