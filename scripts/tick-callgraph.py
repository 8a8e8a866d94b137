#!/usr/bin/env python3
"""What the control interrupt of an image can call: tick-callgraph.py IMAGE BUDGET.

Walks the calls from the tick's vector in the disassembly and fails if a panic or a double-precision routine can be
reached. Indirect calls are listed: the one there is wakes a task through its waker. Needs llvm-objdump; without it
nothing is checked, and that is said.
"""

import glob
import re
import shutil
import subprocess
import sys
import tomllib

ENTRY = "TIM1_UP_TIM10"
FORBIDDEN = re.compile(r"panick?|unwrap_failed|rust_begin_unwind|__aeabi_(d|ul2d|l2d|i2d|ui2d|f2d)[a-z0-9]*$|__(add|sub|mul|div)df3")
FUNCTION = re.compile(r"^[0-9a-f]+ <(.*)>:$")
CALL = re.compile(r"\t(?:bl|blx|b|b\.w|b[a-z]{2}|b[a-z]{2}\.w|cbn?z)\t[^<]*<(.*?)(?:\+0x[0-9a-f]+)?>(?: @.*)?$")


def disassembler():
    found = [shutil.which("llvm-objdump"), *sorted(glob.glob("/usr/bin/llvm-objdump-*"), key=lambda p: int(p.rsplit("-", 1)[1]), reverse=True)]
    # The newest first: old ones do not read names of today's compiler.
    return next((path for path in [*found[1:], found[0]] if path), None)


def main():
    tool = disassembler()
    if tool is None:
        print("tick: no llvm-objdump here, the call graph was not checked")
        return
    text = subprocess.run([tool, "-d", "-C", "--no-show-raw-insn", sys.argv[1]], check=True, capture_output=True, text=True).stdout
    calls, length, current = {}, {}, None
    for line in text.splitlines():
        if start := FUNCTION.match(line):
            current = start[1]
            calls[current], length[current] = set(), 0
        elif current and "\t" in line:
            length[current] += 1
            if call := CALL.search(line):
                calls[current].add(call[1])
            elif re.search(r"\tblx?\tr|\tbx\tr", line):
                calls[current].add("(indirect)")
    if ENTRY not in calls:
        sys.exit(f"tick: there is no {ENTRY} in the image")
    reached, wrong, todo = {}, [], [(ENTRY, "")]
    while todo:
        name, caller = todo.pop()
        if name in reached:
            continue
        reached[name] = caller
        if FORBIDDEN.search(name):
            wrong.append(f"{name}\n  called by {caller}")
            continue
        todo += [(callee, name) for callee in calls.get(name, ())]
    size = sum(length.get(name, 0) for name in reached)
    indirect = [caller for name, caller in reached.items() if name == "(indirect)"]
    print(f"tick: {len(reached)} functions, {size} instructions in all; indirect calls in: {', '.join(indirect) or 'none'}")
    if wrong:
        sys.exit("tick: within its reach is what must not be:\n" + "\n".join(wrong))
    # A vector that only jumps would look clean: the law itself must be in what was walked.
    if size < 300:
        sys.exit(f"tick: {size} instructions cannot be the whole law; the disassembly was not understood")
    with open(sys.argv[2], "rb") as file:
        greatest = tomllib.load(file)["tick"]["greatest_instructions"]
    if size > greatest:
        sys.exit(f"tick: {size} instructions are more than the {greatest} of {sys.argv[2]}")
    print("tick: no panic and no double-precision routine can be reached")


main()
