#!/usr/bin/env python3
"""The table of what a tick takes, held against a budget: tick-counts.py BUDGET PROFILE < lines of firmware-count."""

import sys
import tomllib


def main():
    with open(sys.argv[1], "rb") as file:
        budget = tomllib.load(file)["tick"][sys.argv[2]]
    scenes = []
    for line in sys.stdin:
        parts = line.rstrip("\n").split("|")
        if len(parts) == 4:
            scenes.append((parts[0], *map(int, parts[1:])))
        else:
            print(line, end="")
    if not scenes:
        sys.exit("tick: nothing was counted; what QEMU said stands above")
    print(f"profile {sys.argv[2]}:\n\n| scene | ticks | median | greatest |\n|---|---|---|---|")
    for name, ticks, median, greatest in scenes:
        print(f"| {name} | {ticks} | {median} | {greatest} |")
    over = False
    for what, column, key in ("typical", 2, "typical_executed"), ("worst", 3, "greatest_executed"):
        scene = max(scenes, key=lambda scene: scene[column])
        limit = budget[key]
        print(f"tick, {sys.argv[2]}, {what}: {scene[column]} instructions of {limit} budgeted ({scene[0]})")
        over |= scene[column] > limit
        aim = budget.get("aim_" + key)
        if aim is not None and scene[column] > aim:
            print(f"AIM MISSED: tick, {sys.argv[2]}, {what}: {scene[column]} instructions of {aim} ({scene[0]})")
    if over:
        sys.exit("tick: more instructions than firmware/budget.toml allows")


main()
