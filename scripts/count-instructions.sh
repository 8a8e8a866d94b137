#!/bin/sh
# Counts the instructions of a tick on the target's instruction set under QEMU and checks them against firmware/budget.toml.
# Requirements: those of build-firmware.sh, and qemu-system-arm.
set -eu
cd "$(dirname "$0")/.."
if ! command -v qemu-system-arm >/dev/null 2>&1 && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq && apt-get install -y -qq --no-install-recommends qemu-system-arm || true
fi
if ! command -v qemu-system-arm >/dev/null 2>&1; then
    echo "The instructions cannot be counted here: qemu-system-arm is missing. On Debian: 'apt-get install qemu-system-arm'." >&2
    exit 1
fi
. scripts/firmware-cargo.sh

# `chip` is the flashed profile, `release` the fastest one.
failed=0
for profile in chip release; do
    firmware_cargo build --profile "$profile" -p firmware-count --bin count --bin observe --features qemu
    # One instruction is 1024 ns of virtual time, independent of real time.
    play() {
        timeout 300 qemu-system-arm -M mps2-an386 -icount shift=10 -semihosting -nographic -monitor none -serial none \
            -kernel "$firmware_folder/$firmware_target/$profile/$1" </dev/null
    }
    play count | python3 scripts/tick-counts.py firmware/budget.toml "$profile" || failed=1
    # No pipe: a wrong vector must make QEMU's exit status fail the script.
    observed="$(play observe)" || failed=1
    printf '\n| a step of the observer | states | instructions |\n|---|---|---|\n'
    printf '%s\n' "$observed" | sed 's/^\([^#].*\)|\(.*\)|\(.*\)$/| \1 | \2 | \3 |/'
done
exit $failed
