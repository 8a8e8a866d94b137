#!/bin/sh
# Counts the instructions of a tick on the target's instruction set, under QEMU, and holds them against firmware/budget.toml.
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

# As it is flashed, by the profile `chip`, and as fast as it could be, by `release`.
failed=0
for profile in chip release; do
    firmware_cargo build --profile "$profile" -p firmware-count --bin count --features qemu
    # An instruction is 1024 ns of virtual time, and nothing waits for the real one.
    timeout 300 qemu-system-arm -M mps2-an386 -icount shift=10 -semihosting -nographic -monitor none -serial none \
        -kernel "$firmware_folder/$firmware_target/$profile/count" </dev/null |
        python3 scripts/tick-counts.py firmware/budget.toml "$profile" || failed=1
done
exit $failed
