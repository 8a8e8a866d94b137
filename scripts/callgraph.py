#!/usr/bin/env python3
"""What a function of an image can call, and all that is called by it: callgraph.py IMAGE ENTRY[:most instructions][:+double]…

Walks the calls from each entry in the disassembly and fails if a panic can be reached, or a double-precision routine where `+double` does not
allow it, or if there are more instructions than said. Indirect calls are told: what is behind them is not seen. Needs llvm-objdump; without
it nothing is checked, and that is said.
"""

import bisect
import glob
import re
import shutil
import subprocess
import sys

PANIC = re.compile(r"panick?|unwrap_failed|expect_failed|rust_begin_unwind|slice_index_fail|slice_.*index.*_len_fail")
DOUBLE = re.compile(r"__aeabi_(d|ul2d|l2d|i2d|ui2d|f2d)[a-z0-9]*$|__(add|sub|mul|div)df3")
FUNCTION = re.compile(r"^([0-9a-f]+) <(.*)>:$")
CALL = re.compile(r"\t(?:bl|blx|b|b\.w|b[a-z]{2}|b[a-z]{2}\.w|cbn?z)\t(?:r\d+, |lr, )?(?:#[^<]*|0x([0-9a-f]+) )<.*>")
INDIRECT = "(indirect)"
# What lld fills gaps between functions with (0xd4d4) reads as this branch; no function falls into it.
PADDING = re.compile(r"\tbmi\t.*imm = #-0x58$")


def disassembler():
    found = [shutil.which("llvm-objdump"), *sorted(glob.glob("/usr/bin/llvm-objdump-*"), key=lambda p: int(p.rsplit("-", 1)[1]), reverse=True)]
    # The newest first: old ones do not read names of today's compiler.
    return next((path for path in [*found[1:], found[0]] if path), None)


def graph(tool, image):
    """By a function's address (names repeat: outlined pieces of different crates): its name, the addresses that it calls, its instructions."""
    text = subprocess.run([tool, "-d", "-C", "--no-show-raw-insn", image], check=True, capture_output=True, text=True).stdout
    names, calls, length, current = {}, {}, {}, None
    for line in text.splitlines():
        if start := FUNCTION.match(line):
            current = int(start[1], 16)
            names[current], calls[current], length[current] = start[2], set(), 0
        elif current is not None and "\t" in line and not PADDING.search(line.rstrip()):
            length[current] += 1
            if call := CALL.search(line):
                calls[current].add(int(call[1], 16))
            elif re.search(r"\tblx?\tr|\tbx\tr", line):
                calls[current].add(INDIRECT)
    starts = sorted(names)

    def whole(target):
        """The function that an address lies in: a branch may go into the middle of one."""
        if target == INDIRECT:
            return INDIRECT
        return starts[max(bisect.bisect_right(starts, target) - 1, 0)]

    return names, {caller: {whole(target) for target in targets} for caller, targets in calls.items()}, length


def walk(names, calls, length, entry, most, double):
    """What is wrong with what `entry` reaches, in words."""
    door = next((address for address, name in names.items() if name == entry), None)
    if door is None:
        return [f"there is no {entry} in the image"]
    names = {**names, INDIRECT: INDIRECT}
    reached, wrong, indirect, todo = {}, [], [], [(door, None)]
    while todo:
        function, caller = todo.pop()
        if function == INDIRECT:
            indirect.append(names[caller])
        if function in reached:
            continue
        reached[function] = caller
        name = names[function]
        if PANIC.search(name) or not double and DOUBLE.search(name):
            path = [name]
            while caller is not None:
                path.append(names[caller])
                caller = reached[caller]
            wrong.append("\n  called by ".join(path))
            continue
        todo += [(callee, function) for callee in calls.get(function, ())]
    size = sum(length.get(function, 0) for function in reached)
    print(f"{entry}: {len(reached)} functions, {size} instructions in all; indirect calls in: {', '.join(indirect) or 'none'}")
    # A door that only jumps would look clean: what is behind it must be in what was walked.
    if size < 15:
        wrong.append(f"{size} instructions cannot be all; the disassembly was not understood")
    if most is not None and size > most:
        wrong.append(f"{size} instructions are more than the {most} that firmware/budget.toml allows")
    return wrong


def main():
    tool = disassembler()
    if tool is None:
        print("no llvm-objdump here: the call graph was not checked")
        return
    names, calls, length = graph(tool, sys.argv[1])
    failed = False
    for argument in sys.argv[2:]:
        entry, *rules = argument.split(":")
        most = next((int(rule) for rule in rules if rule.isdigit()), None)
        for wrong in walk(names, calls, length, entry, most, "+double" in rules):
            print(f"{entry}: {wrong}")
            failed = True
    if failed:
        sys.exit("a call graph reaches what it must not")
    print("no panic can be reached, and no double-precision routine where there must be none")


main()
