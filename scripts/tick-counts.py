#!/usr/bin/env python3
"""Prints the instructions of a tick and checks them against a budget: tick-counts.py BUDGET PROFILE < lines of firmware-count."""

import sys
import tomllib


def main():
    with open(sys.argv[1], "rb") as file:
        budget = tomllib.load(file)
    profile = sys.argv[2]
    scenes = []
    for line in sys.stdin:
        parts = line.rstrip("\n").split("|")
        if len(parts) == 4:
            scenes.append((parts[0], *map(int, parts[1:])))
        else:
            print(line, end="")
    if not scenes:
        sys.exit("no tick was counted; the output of QEMU is above")
    print(f"profile {profile}:\n\n| scene | ticks | median | greatest |\n|---|---|---|---|")
    for name, ticks, median, greatest in scenes:
        print(f"| {name} | {ticks} | {median} | {greatest} |")
    name, _, _, worst = max(scenes, key=lambda scene: scene[3])
    limit = budget["handler_instructions"]
    print(f"worst tick, {profile}: {worst} instructions of {limit} budgeted ({name})")
    if worst > limit:
        sys.exit("a tick executes more instructions than firmware/budget.toml allows")


main()
