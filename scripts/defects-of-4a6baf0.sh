#!/usr/bin/env bash
# Shows the defects of the image of commit 4a6baf0: builds that commit in a worktree under target/, as it is and with some of the corrections in
# scripts/defects-of-4a6baf0/, runs today's tests of the emulated chip on each image, and prints the failures. About fifteen minutes on two cores.
# Usage: scripts/defects-of-4a6baf0.sh [VARIANT…]
set -euo pipefail
cd "$(dirname "$0")/.."
root="$PWD"
source="$root/target/defects-of-4a6baf0"
[ -d "$source" ] || git worktree add --detach "$source" 4a6baf0
export CARGO_TARGET_DIR="$root/target/firmware-of-4a6baf0"

# Corrections of each variant, and the tests that run on it: test binaries, then names in them after a colon.
all="1-assert 1-top 2-converter 3-memory 5-caches"
declare -A corrections=(
    [as-committed]=""
    [without-top]="${all/1-top /}"
    [without-converter]="${all/2-converter /}"
    [without-memory]="${all/3-memory /}"
    [without-caches]="${all/ 5-caches/}"
    [starts]="$all"
)
declare -A tests=(
    [as-committed]="boots:"
    [without-top]="boots:core_runs boots:converter"
    [without-converter]="boots:converter"
    [without-memory]="boots:identity"
    [without-caches]="boots:flash_is_read streams:"
    [starts]="boots:identity saves: streams:queries"
)

for variant in "${@:-as-committed without-top without-converter without-memory without-caches starts}"; do
    for name in $variant; do
        git -C "$source" checkout -q .
        for patch in ${corrections[$name]}; do git -C "$source" apply "$root/scripts/defects-of-4a6baf0/$patch.patch"; done
        image="$(cd "$source" && . scripts/firmware-cargo.sh &&
            firmware_cargo build -q --profile chip -p stand-firmware --bin stand --features stm32 >&2 &&
            echo "$firmware_folder/$firmware_target/chip/stand")"
        printf '\n=== 4a6baf0 %s: %s\n' "$name" "${corrections[$name]:-no correction}"
        for selected in ${tests[$name]}; do
            STAND_IMAGE="$image" CARGO_TARGET_DIR="$root/target" RUST_BACKTRACE=0 cargo test -q -p chip-sim --test "${selected%%:*}" -- \
                --include-ignored --nocapture --test-threads 1 ${selected#*:} 2>&1 | grep -a -A4 'panicked at' | cut -c1-240 || true
        done
    done
done
