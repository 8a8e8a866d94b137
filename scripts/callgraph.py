#!/usr/bin/env python3
"""Checks the functions of an image in its disassembly: callgraph.py IMAGE [--frames BUDGET] ENTRY[:+double]…

Follows the calls from each entry and fails if a panic can be reached, or a double-precision routine where `+double` does not allow it. Indirect
calls are listed and not followed. With --frames, prints the largest stack frames and fails if one exceeds `stack_frame_bytes` of the budget.
Needs llvm-objdump; without it nothing is checked, and a message says so.
"""

import bisect
import glob
import re
import shutil
import subprocess
import sys
import tomllib

PANIC = re.compile(r"panick?|unwrap_failed|expect_failed|rust_begin_unwind|slice_index_fail|slice_.*index.*_len_fail")
DOUBLE = re.compile(r"__aeabi_(d|ul2d|l2d|i2d|ui2d|f2d)[a-z0-9]*$|__(add|sub|mul|div)df3")
FUNCTION = re.compile(r"^([0-9a-f]+) <(.*)>:$")
CALL = re.compile(r"\t(?:bl|blx|b|b\.w|b[a-z]{2}|b[a-z]{2}\.w|cbn?z)\t(?:r\d+, |lr, )?(?:#[^<]*|0x([0-9a-f]+) )<.*>")
FRAME = re.compile(r"\tsub(?:\.w|w|s)?\tsp, (?:sp, )?#(0x[0-9a-f]+|[0-9]+)")
INDIRECT = "(indirect)"
# lld's filler between functions (0xd4d4) disassembles as this branch; no function falls through into it.
PADDING = re.compile(r"\tbmi\t.*imm = #-0x58$")


def disassembler():
    found = [shutil.which("llvm-objdump"), *sorted(glob.glob("/usr/bin/llvm-objdump-*"), key=lambda p: int(p.rsplit("-", 1)[1]), reverse=True)]
    # Newest version first: old ones cannot demangle current names.
    return next((path for path in [*found[1:], found[0]] if path), None)


def graph(tool, image):
    """Maps from function address (names repeat) to name, called addresses, instruction count and stack frame size in bytes."""
    text = subprocess.run([tool, "-d", "-C", "--no-show-raw-insn", image], check=True, capture_output=True, text=True).stdout
    names, calls, length, frames, current = {}, {}, {}, {}, None
    for line in text.splitlines():
        if start := FUNCTION.match(line):
            current = int(start[1], 16)
            names[current], calls[current], length[current], frames[current] = start[2], set(), 0, 0
        elif current is not None and "\t" in line and not PADDING.search(line.rstrip()):
            length[current] += 1
            if frame := FRAME.search(line):
                frames[current] += int(frame[1], 0)
            if call := CALL.search(line):
                calls[current].add(int(call[1], 16))
            elif re.search(r"\tblx?\tr|\tbx\tr", line):
                calls[current].add(INDIRECT)
    starts = sorted(names)

    def whole(target):
        """The function that contains an address; a branch may target the middle of a function."""
        if target == INDIRECT:
            return INDIRECT
        return starts[max(bisect.bisect_right(starts, target) - 1, 0)]

    return names, {caller: {whole(target) for target in targets} for caller, targets in calls.items()}, length, frames


def defects_reached(names, calls, length, entry, double):
    """Messages about forbidden functions reachable from `entry`."""
    start = next((address for address, name in names.items() if name == entry), None)
    if start is None:
        return [f"there is no {entry} in the image"]
    names = {**names, INDIRECT: INDIRECT}
    reached, wrong, indirect, todo = {}, [], [], [(start, None)]
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
    # An entry that only jumps must have its target followed.
    if size < 15:
        wrong.append(f"only {size} instructions were found; the disassembly was not understood")
    return wrong


def main():
    tool = disassembler()
    if tool is None:
        print("llvm-objdump is missing: the call graph was not checked")
        return
    image, *arguments = sys.argv[1:]
    names, calls, length, frames = graph(tool, image)
    failed = False
    if arguments[:1] == ["--frames"]:
        with open(arguments[1], "rb") as file:
            limit = tomllib.load(file)["stack_frame_bytes"]
        arguments = arguments[2:]
        largest = sorted(frames, key=frames.get, reverse=True)[:5]
        print(f"largest stack frames, of {limit} B budgeted:")
        for function in largest:
            print(f"  {frames[function]:>6} B  {names[function]}")
        failed = frames[largest[0]] > limit
    for argument in arguments:
        entry, *rules = argument.split(":")
        for defect in defects_reached(names, calls, length, entry, "+double" in rules):
            print(f"{entry}: {defect}")
            failed = True
    if failed:
        sys.exit("a stack frame is too large, or a call graph reaches a forbidden function")
    print("no panic can be reached, and no double-precision routine where it is forbidden")


main()
