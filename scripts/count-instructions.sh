#!/bin/sh
# Counts the instructions of a tick on the target's instruction set, under QEMU, and checks them against firmware/budget.toml.
# Needs what build-firmware.sh needs, and qemu-system-arm.
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

# With the profile of the flashed image.
profile=chip
firmware_cargo build --profile "$profile" -p firmware-count --bin count --bin observe --features qemu
# An instruction is 1024 ns of virtual time, without waiting for real time.
play() {
    timeout 300 qemu-system-arm -M mps2-an386 -icount shift=10 -semihosting -nographic -monitor none -serial none \
        -kernel "$firmware_folder/$firmware_target/$profile/$1" </dev/null
}
failed=0
play count | python3 scripts/tick-counts.py firmware/budget.toml "$profile" || failed=1
# Without a pipe: a wrong test vector ends QEMU with a failure.
observed="$(play observe)" || failed=1
printf '\n| a step of the observer | states | instructions |\n|---|---|---|\n'
printf '%s\n' "$observed" | sed 's/^\([^#].*\)|\(.*\)|\(.*\)$/| \1 | \2 | \3 |/'
exit $failed
