#!/usr/bin/env bash
# Full campaigns behind the tables of docs/, in pieces of some minutes on two cores; `explain` and `planted` take hours and go on where they were interrupted.
# Usage: scripts/full-benches.sh           lists the pieces
#        scripts/full-benches.sh PIECE…    runs these pieces; `all` runs all
# Pieces marked with * need external records: STAND_DATA names their folder (docs/figures.md).
set -euo pipefail
cd "$(dirname "$0")/.."

bench() { cargo bench -q -p stand-tests --bench "$@"; }
campaign() { cargo run -q --release -p stand-tests --bin campaign -- "$@"; }
# 200 attempts of a scripted student; of the hunt, which takes half a minute for each, 30.
lab() { LAB_SEEDS="$2" cargo test -q --release -p stand --test lab "lab_course::honest_student_of_$1" -- --include-ignored --nocapture; }
# The image at another opt-level, in a target folder of its own, and the tests of the chip on it. Exceeded limits are printed and do not end the piece.
image_at_level() {
    local folder="target/opt-level-$1" image
    CARGO_TARGET_DIR="$folder" CARGO_PROFILE_CHIP_OPT_LEVEL="$1" scripts/build-firmware.sh || echo "above: limits of firmware/budget.toml that are exceeded"
    image="$PWD/$(find "$folder" -path '*/thumbv7em-none-eabihf/chip/stand')"
    STAND_IMAGE="$image" cargo test -q -p chip-sim --test chip budget:: -- --include-ignored --nocapture || true
    STAND_IMAGE="$image" cargo test -q -p chip-sim --no-fail-fast -- --include-ignored --skip instructions_agree_with_qemu --skip budget:: || true
}

declare -A pieces=(
    [foreign-fits*]="bench foreign_cases"
    [real-records*]="cargo test -q --release -p stand-tests --test identification real_records:: -- --include-ignored --nocapture"
    [where-it-fails*]="cargo run -q --release -p stand-tests --example where_it_fails -- 60"
    [explain]="campaign explain --set release"
    [explain-foreign*]="campaign explain foreign/"
    [planted]="campaign planted"
    [sensor-under-test]="bench sensor -- 300 1"
    [coverage]="bench coverage"
    [voltage-slope]="bench voltage_slope"
    [fits]="bench fits"
    [sizes]="bench sizes -- import compare fit 5-logs-of-10-s 200-Hz 1-kHz 20-kHz hour"
    [sizes-explain]="bench sizes -- explain 5-logs-of-10-s 200-Hz 1-kHz 20-kHz"
    [sizes-explain-hour]="bench sizes -- explain hour"
    [simulator-speed]="cargo bench -q -p hal-sim --bench times_real_time"
    [hour-of-telemetry]="cargo bench -q -p hal-sim --bench hour_of_telemetry"
    [calibration-gyro-1]="bench calibration -- 250 1 gyro"
    [calibration-gyro-2]="bench calibration -- 250 251 gyro"
    [calibration-gyro-3]="bench calibration -- 250 501 gyro"
    [calibration-gyro-4]="bench calibration -- 250 751 gyro"
    [calibration-accel]="bench calibration -- 300 1 accel"
    [calibration-drive]="bench calibration -- 400 1 drive"
    [drift]="bench drift_monte_carlo"
    [drift-coverage]="bench drift_coverage"
    [allan]="bench allan"
    [allan-coverage]="bench allan_coverage"
    [lab-motor]="lab motor 200"
    [lab-friction]="lab friction 200"
    [lab-once-per-turn]="lab once_per_turn 200"
    [lab-gyro]="lab gyro 200"
    [lab-accelerometer]="lab accelerometer 200"
    [lab-drift]="lab drift 200"
    [lab-observers]="lab observers 200"
    [lab-hunt]="lab the_hunt 30"
    [rate-accuracy]="cargo run -q --release -p stand-tests --example rate_accuracy"
    [fuzz]="STAND_FUZZ=1000000 cargo test -q --release -p stand-tests --test project fuzz:: -- --nocapture"
    [reliability]="STAND_MOMENTS=200 cargo test -q --release -p stand --test processes reliability:: -- --nocapture"
    [image]="scripts/build-firmware.sh"
    [tick]="cargo test -q -p chip-sim --test chip budget:: -- --include-ignored --nocapture"
    [image-level-3]="image_at_level 3"
    [image-level-s]="image_at_level s"
    [chip-telemetry]="STAND_TELEMETRY_S=600 cargo test -q -p chip-sim --test chip streams::telemetry_loses -- --include-ignored --nocapture"
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
    bash -euo pipefail -c "$command"
done
