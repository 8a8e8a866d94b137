#!/usr/bin/env python3
"""Builds and runs all tests of the workspace, and prints what each test program printed when it ends.

`cargo test` runs the programs one after the other, and most of them keep only one processor busy. Here as many programs run as there are processors,
each with one test at a time. Programs that wait for a serial line, a socket or a page in real time run alone, after the others. A failure does not
stop the rest.

Usage: scripts/run-tests.py [--release] [--no-run | ARGUMENT...]; the arguments are those of the test programs, as after `cargo test --`. `--release` builds with that
profile. `--no-run` builds the tests and `stand`, and runs nothing.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed

# They have time limits or wait in real time, which a busy processor would spoil.
ALONE = {
    "calibrate_faults", "fleet", "host_tools", "lab_real_stand", "panel", "panel_laboratory", "panel_measure", "panel_security", "record_store",
    "reliability", "serial_line", "settings_command", "shell_command", "sim_long", "tcp_line",
}  # fmt: skip

# They take minutes and begin first, so that no processor waits for one of them at the end.
LONG = ["explains", "lab_course", "prediction_error", "dirty_logs", "options", "drift_covered", "drives"]


def test_programs(profile):
    """Name, path and package folder of each test program, after they are built."""
    build = ["cargo", "test", *profile, "--workspace", "--no-run", "--message-format=json-render-diagnostics"]
    built = subprocess.run(build, stdout=subprocess.PIPE, text=True)
    if built.returncode:
        sys.exit(built.returncode)  # cargo has said why
    for message in map(json.loads, built.stdout.splitlines()):
        if message["reason"] == "compiler-artifact" and message["executable"] and message["profile"]["test"]:
            yield message["target"]["name"], message["executable"], os.path.dirname(message["manifest_path"])


def passes(program, arguments):
    """Runs a test program in the folder of its package, as cargo does; prints its output at its end."""
    name, executable, folder = program
    begin = time.monotonic()
    environment = {**os.environ, "CARGO_MANIFEST_DIR": folder}
    run = subprocess.run([executable, *arguments], cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    output = run.stdout.decode(errors="replace").strip()
    print(f"\n     {name} in {os.path.basename(folder)}, {time.monotonic() - begin:.0f} s\n{output}", flush=True)
    return run.returncode == 0


def main():
    options = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    options.add_argument("--release", action="store_true")
    options.add_argument("--no-run", action="store_true")
    own, arguments = options.parse_known_args()
    if own.no_run and arguments:
        print(f"run-tests.py: --no-run takes no arguments of test programs: {' '.join(arguments)}", file=sys.stderr)
        sys.exit(2)
    profile = ["--release"] if own.release else []
    programs = list(test_programs(profile))
    if own.no_run:
        return
    computing = sorted((p for p in programs if p[0] not in ALONE), key=lambda p: LONG.index(p[0]) if p[0] in LONG else len(LONG))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        runs = {pool.submit(passes, program, [*arguments, "--test-threads=1"]): program for program in computing}
        failed = [runs[run] for run in as_completed(runs) if not run.result()]
    failed += [program for program in programs if program[0] in ALONE and not passes(program, arguments)]
    documentation = subprocess.run(["cargo", "test", *profile, "--workspace", "--doc", "--", *arguments])
    if failed:
        print("\nfailed: " + ", ".join(f"{name} in {os.path.basename(folder)}" for name, _, folder in failed))
    sys.exit(1 if failed or documentation.returncode else 0)


main()
