#!/usr/bin/env python3
"""Comparison of chip-sim's instruction set with QEMU's (Python module unicorn, `pip install unicorn`).

usage: compare_with_unicorn.py EXECUTE [--cases N] [--seed S] [--image ELF]
EXECUTE is the example binary `execute` of chip-sim. Random encodings of all groups, and with --image those in the image's .text, run once each
with random registers and memory in both; registers, flags, FPSCR.NZCV and written bytes are compared.
Exit code 1 if anything differs.
Not compared: encodings that end in an event (SVC, BKPT, WFE ...), accesses outside the two memory regions, unaligned accesses that QEMU refuses,
encodings that chip-sim refuses as unpredictable and QEMU executes (counted), special registers beyond the APSR, results under a rounding
mode other than nearest except VCVTR, cumulative flags of FPSCR (not modelled),
ITSTATE (QEMU brings it up to date only at the end of a translated block; the skipping itself is compared).
"""
import argparse, collections, random, struct, subprocess, sys
from unicorn import Uc, UcError, UC_ARCH_ARM, UC_MODE_THUMB, UC_MODE_MCLASS, UC_HOOK_MEM_WRITE, UC_ERR_INSN_INVALID, UC_ERR_EXCEPTION
from unicorn import UC_ERR_FETCH_UNMAPPED
import unicorn.arm_const as arm

FLASH, RAM, SIZE, CODE = 0x08000000, 0x20000000, 0x10000, 0x08008000
R = [getattr(arm, f"UC_ARM_REG_R{k}") for k in range(13)] + [arm.UC_ARM_REG_SP, arm.UC_ARM_REG_LR]
S = [getattr(arm, f"UC_ARM_REG_S{k}") for k in range(32)]
STATE = R + [arm.UC_ARM_REG_XPSR] + S + [arm.UC_ARM_REG_FPSCR]
# N, Z, C, V, Q. Unicorn gives no access to GE: a SEL after each SIMD instruction shows it.
FLAGS = 0xF8000000
SEL = bytes.fromhex("a0fa81f6")  # sel r6, r0, r1
VMOV = bytes.fromhex("b0ee400a")  # vmov.f32 s0, s0
FLOATS = [0, 0x80000000, 0x3F800000, 0xBF800000, 0x7F800000, 0xFF800000, 0x7FC00000, 0xFFC12345, 0x7F800001, 0xFF812345, 1, 0x807FFFFF,
          0x00800000, 0x7F7FFFFF, 0x4F000000, 0xCF000000, 0x3F000000, 0x40200000, 0x4B000001, 0x47800000]
INTEGERS = [0, 1, 2, 31, 32, 33, 255, 0x7FFFFFFF, 0x80000000, 0x80000001, 0xFFFFFFFF, 0x8000, 0x7FFF, 0xFFFF8000, 0x80008000, 0x7FFF7FFF]


def pattern(start):
    return b"".join(struct.pack("<I", (a * 2654435761 & 0xFFFFFFFF) >> 3) for a in range(start, start + SIZE, 4))


def text_encodings(path):
    """Distinct encodings of .text in a linear sweep; literal pools give some that never execute."""
    data = open(path, "rb").read()
    offset, entries, names = struct.unpack_from("<I", data, 32)[0], *struct.unpack_from("<HH", data, 48)
    sections = [struct.unpack_from("<10I", data, offset + 40 * k) for k in range(entries)]
    table = data[sections[names][4]:]
    found = {}
    for section in sections:
        if table[section[0]:].split(b"\0")[0] != b".text":
            continue
        text = data[section[4]:section[4] + section[5]]
        k = 0
        while k + 2 <= len(text):
            n = 4 if text[k + 1] >= 0xE8 else 2
            found[text[k:k + n]] = True
            k += n
    return [code for code in found if len(code) in (2, 4)]


def random_encoding(rng):
    kind = rng.random()
    if kind < 0.25:
        return struct.pack("<H", rng.randrange(0xE800))
    second = rng.getrandbits(16)
    if kind < 0.5:  # floating point
        first = rng.choice([0xEE00, 0xEE00, 0xEE00, 0xEC00]) | rng.getrandbits(8 if rng.random() < 0.9 else 10)
        if first >> 8 == 0xEC:
            first |= rng.getrandbits(1) << 8
        second = second & 0xF0EF | rng.choice([0xA00, 0xA00, 0xB00]) | (rng.getrandbits(1) << 4 if rng.random() < 0.3 else 0)
    elif kind < 0.75:  # multiplication, SIMD, shifts
        first = 0xFA00 | rng.getrandbits(9)
        second |= 0xF000 if first < 0xFB00 else 0
    else:
        first = rng.randrange(0xE800, 0x10000)
    return struct.pack("<HH", first, second)


def excluded(code):
    first = struct.unpack_from("<H", code)[0]
    if len(code) == 2:
        return first >> 8 in (0xBE, 0xDF)
    second = struct.unpack_from("<H", code, 2)[0]
    return first >> 5 == 0xF380 >> 5 and second >> 14 == 2 and second & 0xFF > 3 or first == 0xF3EF and second & 0xFF > 3


def value(rng, addresses):
    kind = rng.random()
    if addresses:
        return RAM + rng.randrange(0x4000, 0xC000, 4) if kind < 0.8 else rng.randrange(256)
    return rng.choice(INTEGERS) if kind < 0.3 else rng.getrandbits(32)


def make_case(rng, code):
    first = struct.unpack_from("<H", code)[0]
    memory = first >> 12 in (5, 6, 7, 8, 9, 12) or first >> 9 in (0x5A, 0x5E) or first >> 8 in (0xE8, 0xE9, 0xF8, 0xF9, 0xEC, 0xED) or rng.random() < 0.1
    registers = [value(rng, memory) for _ in range(15)]
    registers[13] &= ~3
    if rng.random() < 0.9:
        registers[13] = RAM + rng.randrange(0x4000, 0xC000, 4)
    xpsr = rng.getrandbits(32) & FLAGS | 1 << 24
    floats = [rng.choice(FLOATS) if rng.random() < 0.5 else rng.getrandbits(32) if rng.random() < 0.5 else struct.unpack("<I", struct.pack("<f", rng.uniform(-70000, 70000)))[0] for _ in range(32)]
    fpscr = rng.getrandbits(4) << 28 | (1 << 25 if rng.random() < 0.1 else 0) | (1 << 24 if rng.random() < 0.1 else 0)
    if len(code) == 4 and first & 0xFFBE == 0xEEBC and code[2] & 0x80 == 0:
        fpscr |= rng.getrandbits(2) << 22  # VCVTR
    steps = 1
    if rng.random() < 0.2 and first >> 8 != 0xBF and not first >> 11 == 0x1E and not (len(code) == 2 and first >> 12 == 13) and first & 0xF500 != 0xB100:
        code, steps = struct.pack("<H", 0xBF08 | rng.randrange(14) << 4) + code, 2
    elif first >> 7 == 0xFA80 >> 7:
        code, steps = code + SEL, 2
    return steps, code, registers + [xpsr] + floats + [fpscr]


class Reference:
    def __init__(self):
        self.start()

    def start(self):
        self.uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        self.image = {FLASH: pattern(FLASH), RAM: pattern(RAM)}
        for start, content in self.image.items():
            self.uc.mem_map(start, SIZE)
            self.uc.mem_write(start, content)
        self.uc.reg_write(arm.UC_ARM_REG_C1_C0_2, 0xF << 20)
        self.uc.reg_write(arm.UC_ARM_REG_FPEXC, 1 << 30)
        # Opens the floating-point context, which would reset FPSCR in the first case.
        self.uc.mem_write(CODE, VMOV)
        self.uc.emu_start(CODE | 1, CODE + 4, count=1)
        self.uc.hook_add(UC_HOOK_MEM_WRITE, self.on_write)
        self.written = {}

    def on_write(self, uc, access, address, size, number, _):
        for k in range(size):
            self.written[address + k] = number >> 8 * k & 0xFF

    def execute(self, steps, code, state):
        self.written = {}
        self.uc.mem_write(CODE, code)
        for register, number in zip(STATE, state):
            self.uc.reg_write(register, number)
        # The translation of the previous case at the same address would run otherwise.
        self.uc.ctl_flush_tb()
        error = None
        try:
            # QEMU does not count an instruction that its IT block skips, so the end address stops the run too.
            self.uc.emu_start(CODE | 1, CODE + len(code), count=steps)
        except UcError as problem:
            error = problem.errno
        result = [self.uc.reg_read(register) for register in STATE]
        pc = self.uc.reg_read(arm.UC_ARM_REG_PC)
        for address in self.written:
            start = FLASH if address < RAM else RAM
            if 0 <= address - start < SIZE:
                self.uc.mem_write(address, self.image[start][address - start:address - start + 1])
        self.uc.mem_write(CODE, self.image[FLASH][CODE - FLASH:CODE - FLASH + 8])
        if error is not None:
            # The emulator stays in its exception otherwise.
            self.start()
        return error, pc, result, self.written


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("execute")
    parser.add_argument("--cases", type=int, default=20000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--image")
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    real = text_encodings(arguments.image) if arguments.image else []
    cases = []
    for k in range(arguments.cases):
        code = real[k % len(real)] if real and k % 2 else random_encoding(rng)
        while excluded(code):
            code = random_encoding(rng)
        cases.append(make_case(rng, code))
    lines = "".join(f"{steps} {code.hex()} " + " ".join(f"{x:x}" for x in state) + "\n" for steps, code, state in cases)
    output = subprocess.run([arguments.execute], input=lines, capture_output=True, text=True, check=True).stdout.splitlines()
    reference = Reference()
    count, differences, refused = collections.Counter(), collections.Counter(), collections.Counter()
    shown = {}
    for index, ((steps, code, state), line) in enumerate(zip(cases, output, strict=True)):
        status, pc, *rest = line.split()
        # A fault costs a new emulator, so only one in 20 undefined encodings runs there.
        if status == "undefined" and index % 20:
            count["undefined, not run in the reference"] += 1
            continue
        if status in ("outside", "event"):
            count[status] += 1
            continue
        mine = [int(x, 16) for x in rest[:49]]
        writes = {int(a, 16): int(b, 16) for a, b in (x.split(":") for x in rest[49:])}
        error, their_pc, theirs, their_writes = reference.execute(steps, code, state)
        name = code.hex() if len(code) == 2 else struct.pack(">" + "H" * (len(code) // 2), *struct.unpack("<" + "H" * (len(code) // 2), code)).hex()
        if status == "undefined" and error is None:
            count["refused by chip-sim only"] += 1
            refused[name[-8:-4] if len(code) > 2 else name] += 1
            continue
        if status == "undefined":
            count["undefined in both"] += 1
            continue
        if error not in (None, UC_ERR_FETCH_UNMAPPED):
            kind = f"reference error {error}"
            # 7: unaligned LDM, LDRD ... end in a fault of QEMU; UC_ERR_EXCEPTION stands for it.
            if error == UC_ERR_EXCEPTION and any(x & 3 for x in state[:15]):
                count["unaligned or fault in the reference"] += 1
                continue
            differences[kind] += 1
            shown.setdefault(kind, []).append(name)
            continue
        count["compared"] += 1
        wrong = [f"r{k}" for k in range(15) if mine[k] != theirs[k]]
        wrong += ["flags"] if (mine[15] ^ theirs[15]) & FLAGS else []
        wrong += [f"s{k}" for k in range(32) if mine[16 + k] != theirs[16 + k]]
        wrong += ["fpscr"] if (mine[48] ^ theirs[48]) >> 22 & 0x3DF else []
        wrong += ["pc"] if int(pc, 16) != their_pc & ~1 else []
        wrong += ["memory"] if writes != their_writes else []
        if wrong:
            kind = ",".join(sorted({w.rstrip("0123456789") for w in wrong}))
            differences[kind] += 1
            shown.setdefault(kind, []).append(f"{name} {wrong[:3]} mine {[hex(mine[STATE_INDEX[w]]) for w in wrong[:2] if w in STATE_INDEX]} theirs {[hex(theirs[STATE_INDEX[w]]) for w in wrong[:2] if w in STATE_INDEX]} pc {pc} {their_pc:x} fpscr {state[48]:x}")
    print(f"encodings {len({code for _, code, _ in cases})}, the image has {len(real)}; cases {len(cases)}")
    print(dict(count))
    print("refused as unpredictable by chip-sim only, most frequent:", refused.most_common(12))
    print("differences:", dict(differences))
    for kind, examples in shown.items():
        for example in examples[:8]:
            print(" ", kind, example)
    sys.exit(1 if differences else 0)


STATE_INDEX = {f"r{k}": k for k in range(15)} | {"flags": 15, "fpscr": 48} | {f"s{k}": 16 + k for k in range(32)}
if __name__ == "__main__":
    main()
