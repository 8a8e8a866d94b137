#!/usr/bin/env python3
"""Licences of the libraries in `stand`: name, version, licence and the licence's text as each library ships it. Printed to standard output."""

import json
import pathlib
import subprocess
import sys

NAMES = ("license", "licence", "copying", "unlicense", "notice")


def packages():
    """Libraries that are linked into the command, from cargo's metadata."""
    metadata = json.loads(subprocess.check_output(["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", "x86_64-unknown-linux-gnu"]))
    by_id = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    root = next(package["id"] for package in metadata["packages"] if package["name"] == "stand")
    found, open_ids = set(), [root]
    while open_ids:
        one = open_ids.pop()
        if one in found:
            continue
        found.add(one)
        # Neither build scripts nor tests are in the program.
        open_ids += [dep["pkg"] for dep in nodes[one]["deps"] if any(kind["kind"] is None for kind in dep["dep_kinds"])]
    return sorted((by_id[one] for one in found if by_id[one]["source"]), key=lambda package: (package["name"], package["version"]))


def main():
    missing = []
    for package in packages():
        folder = pathlib.Path(package["manifest_path"]).parent
        texts = sorted(path for path in folder.iterdir() if path.is_file() and path.name.lower().startswith(NAMES))
        print("=" * 100)
        print(f"{package['name']} {package['version']}: {package['license'] or 'see below'}")
        print(", ".join(package["authors"]))
        for path in texts:
            print(f"--- {path.name}\n{path.read_text(errors='replace').rstrip()}")
        if not texts:
            missing.append(package["name"])
            if not package["license"]:
                sys.exit(f"third-party-licences.py: {package['name']} states no licence")
    print("=" * 100)
    print("These libraries ship no text beside the name of their licence: " + ", ".join(missing))


main()
