#!/usr/bin/env bash
# Campaigns and measurements behind the tables of docs/, in pieces. A piece of a campaign that is interrupted after 20 minutes goes on where
# it was when it is run again.
# Usage: scripts/full-benches.sh           lists the pieces
#        scripts/full-benches.sh PIECE…    runs these pieces; `all` runs all
# Pieces marked with * need external records: STAND_DATA names their folder.
set -euo pipefail
cd "$(dirname "$0")/.."

bench() { cargo bench -q -p stand-tests --bench "$@"; }
campaign() { cargo run -q -p stand-tests --bin campaign -- "$@"; }
# 200 attempts of a scripted student; of the hunt, which takes half a minute for each, 30.
lab() { LAB_SEEDS="$2" cargo test -q -p stand --test lab "honest_student_of_$1" -- --include-ignored --nocapture; }
# The image at another opt-level, in a target folder of its own, and the tests of the chip on it. Exceeded limits are printed and do not end
# the piece.
image_at_level() {
    local folder="target/opt-level-$1" image
    CARGO_TARGET_DIR="$folder" CARGO_PROFILE_CHIP_OPT_LEVEL="$1" scripts/build-firmware.sh || echo "above: limits of firmware/budget.toml that are exceeded"
    image="$PWD/$(find "$folder" -path '*/thumbv7em-none-eabihf/chip/stand')"
    STAND_IMAGE="$image" cargo test -q -p chip-sim --test chip budget -- --include-ignored --nocapture || true
    STAND_IMAGE="$image" cargo test -q -p chip-sim --no-fail-fast -- --include-ignored --skip instructions_agree_with_qemu --skip heavy_use || true
}

declare -A pieces=(
    [explain]="campaign explain"
    [explain-release]="campaign explain --set release"
    [coverage]="campaign coverage"
    [planted]="campaign planted"
    [gyros]="campaign coverage --cases 250 calibrate/gyro"
    [drives]="campaign coverage --cases 250 calibrate/drive"
    [drift-sessions]="campaign coverage --cases 150 drift"
    [allan-mixtures]="campaign coverage --cases 400 allan"
    [foreign-fits*]="bench foreign_cases"
    [real-records*]="cargo test -q -p stand-tests --test identification real_records -- --include-ignored --nocapture"
    [where-it-fails*]="cargo run -q -p stand-tests --example where_it_fails -- 60"
    [sensor-under-test]="bench sensor -- 300 1"
    [voltage-slope]="bench voltage_slope"
    [fits]="bench fits"
    [sizes]="bench sizes -- import compare fit 5-logs-of-10-s 200-Hz 1-kHz 20-kHz hour"
    [sizes-explain]="bench sizes -- explain 5-logs-of-10-s 200-Hz 1-kHz 20-kHz"
    [sizes-explain-hour]="bench sizes -- explain hour"
    [simulator-speed]="cargo bench -q -p hal-sim --bench times_real_time"
    [hour-of-telemetry]="cargo bench -q -p hal-sim --bench hour_of_telemetry"
    [drift]="bench drift_monte_carlo"
    [allan]="bench allan"
    [lab-motor]="lab motor 200"
    [lab-friction]="lab friction 200"
    [lab-once-per-turn]="lab once_per_turn 200"
    [lab-gyro]="lab gyro 200"
    [lab-accelerometer]="lab accelerometer 200"
    [lab-drift]="lab drift 200"
    [lab-observers]="lab observers 200"
    [lab-hunt]="lab the_hunt 30"
    [rate-accuracy]="cargo run -q -p stand-tests --example rate_accuracy"
    [fuzz]="STAND_FUZZ=1000000 cargo test -q -p stand-tests --test project fuzz -- --nocapture"
    [reliability]="STAND_MOMENTS=200 cargo test -q -p stand --test processes reliability -- --nocapture"
    [image]="scripts/build-firmware.sh"
    [tick]="cargo test -q -p chip-sim --test chip budget -- --include-ignored --nocapture"
    [image-level-3]="image_at_level 3"
    [image-level-s]="image_at_level s"
    [chip-telemetry]="STAND_TELEMETRY_S=600 cargo test -q -p chip-sim --test chip telemetry_loses -- --include-ignored --nocapture"
)
names() { printf '%s\n' "${!pieces[@]}" | sort; }

if [ $# = 0 ]; then
    names | while read -r name; do printf '%-20s %s\n' "$name" "${pieces[$name]}"; done
    exit
fi
[ "$*" = all ] && mapfile -t selected < <(names) || selected=("$@")

commit="$(git rev-parse --short HEAD)$(git diff --quiet HEAD || echo +changes)"
export -f bench campaign lab image_at_level
for name in "${selected[@]}"; do
    name="${name%\*}"
    command="${pieces[$name]:-}"
    if [ -z "$command" ]; then
        command="${pieces[$name*]:-}"
        [ -n "$command" ] || { echo "full-benches.sh: no piece \`$name\`; without arguments the pieces are listed" >&2; exit 2; }
        [ -n "${STAND_DATA:-}" ] || { echo "full-benches.sh: \`$name\` needs external records: set STAND_DATA to their folder" >&2; exit 2; }
    fi
    printf '\n=== %s: commit %s, %s, %s cores\n' "$name" "$commit" "$(date -I)" "$(nproc)"
    timeout 1200 bash -euo pipefail -c "$command"
done
