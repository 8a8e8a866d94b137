#!/usr/bin/env python3
"""What a function of an image can call, and all that is called by it: callgraph.py IMAGE ENTRY[:most instructions][:+double]…

Walks the calls from each entry in the disassembly and fails if a panic can be reached, or a double-precision routine where `+double` does not
allow it, or if there are more instructions than said. Indirect calls are told: what is behind them is not seen. Needs llvm-objdump; without
it nothing is checked, and that is said.
"""

import glob
import re
import shutil
import subprocess
import sys

PANIC = re.compile(r"panick?|unwrap_failed|expect_failed|rust_begin_unwind|slice_index_fail|slice_.*index.*_len_fail")
DOUBLE = re.compile(r"__aeabi_(d|ul2d|l2d|i2d|ui2d|f2d)[a-z0-9]*$|__(add|sub|mul|div)df3")
FUNCTION = re.compile(r"^[0-9a-f]+ <(.*)>:$")
CALL = re.compile(r"\t(?:bl|blx|b|b\.w|b[a-z]{2}|b[a-z]{2}\.w|cbn?z)\t[^<]*<(.*?)(?:\+0x[0-9a-f]+)?>(?: @.*)?$")
INDIRECT = "(indirect)"


def disassembler():
    found = [shutil.which("llvm-objdump"), *sorted(glob.glob("/usr/bin/llvm-objdump-*"), key=lambda p: int(p.rsplit("-", 1)[1]), reverse=True)]
    # The newest first: old ones do not read names of today's compiler.
    return next((path for path in [*found[1:], found[0]] if path), None)


def graph(tool, image):
    """The functions that each function calls, and its instructions."""
    text = subprocess.run([tool, "-d", "-C", "--no-show-raw-insn", image], check=True, capture_output=True, text=True).stdout
    calls, length, current = {}, {}, None
    for line in text.splitlines():
        if start := FUNCTION.match(line):
            current = start[1]
            calls.setdefault(current, set())
            length.setdefault(current, 0)
        elif current and "\t" in line:
            length[current] += 1
            if call := CALL.search(line):
                calls[current].add(call[1])
            elif re.search(r"\tblx?\tr|\tbx\tr", line):
                calls[current].add(INDIRECT)
    return calls, length


def walk(calls, length, entry, most, double):
    """What is wrong with what `entry` reaches, in words."""
    if entry not in calls:
        return [f"there is no {entry} in the image"]
    reached, wrong, todo = {}, [], [(entry, "")]
    while todo:
        name, caller = todo.pop()
        if name in reached:
            if name == INDIRECT:
                reached[name].append(caller)
            continue
        reached[name] = [caller]
        if PANIC.search(name) or not double and DOUBLE.search(name):
            wrong.append(f"{name}\n  called by {caller}")
            continue
        todo += [(callee, name) for callee in calls.get(name, ())]
    size = sum(length.get(name, 0) for name in reached)
    indirect = ", ".join(reached.get(INDIRECT, [])) or "none"
    print(f"{entry}: {len(reached)} functions, {size} instructions in all; indirect calls in: {indirect}")
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
    calls, length = graph(tool, sys.argv[1])
    failed = False
    for argument in sys.argv[2:]:
        entry, *rules = argument.split(":")
        most = next((int(rule) for rule in rules if rule.isdigit()), None)
        for wrong in walk(calls, length, entry, most, "+double" in rules):
            print(f"{entry}: {wrong}")
            failed = True
    if failed:
        sys.exit("a call graph reaches what it must not")
    print("no panic can be reached, and no double-precision routine where there must be none")


main()
