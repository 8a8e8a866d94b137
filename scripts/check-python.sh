#!/usr/bin/env bash
# The Python package as a user has it: the wheel for every x86-64 is built, installed into an empty environment, and tested there; types,
# notebooks.
# Usage: scripts/check-python.sh [FOLDER]; the wheel is left in FOLDER, default target/wheels. Needs cargo and Python 3.10 or later with
# venv.
# WHEEL_PROFILE=dev builds it for this machine only, with the dependencies that `cargo test --workspace` has built.
set -euo pipefail
cd "$(dirname "$0")/.."
target="$(realpath -m "${CARGO_TARGET_DIR:-target}")"
wheels="$(realpath -m "${1:-$target/wheels}")"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
part() { printf -- '--- %s (%d s)\n' "$1" "$SECONDS"; }

part "wheel"
python3 -m venv "$work/build"
"$work/build/bin/pip" install --quiet 'maturin>=1.9,<2'
rm -f "$wheels"/rotary_stand-*.whl
profile="${WHEEL_PROFILE:-dist}"
(
    if [ "$profile" = dist ]; then
        # `.cargo/config.toml` compiles for this machine; a wheel is for all. The folder is its own, so that the builds do not replace each
        # other.
        export RUSTFLAGS=-Ctarget-cpu=x86-64 CARGO_TARGET_DIR="$target/baseline"
    fi
    "$work/build/bin/maturin" build --quiet --manifest-path python/Cargo.toml --profile "$profile" --out "$wheels"
)
wheel="$(ls "$wheels"/rotary_stand-*.whl)"
printf '%s: %d KB\n' "$(basename "$wheel")" "$(($(stat -c %s "$wheel") / 1024))"

part "the wheel alone: numpy is its only dependency"
python3 -m venv "$work/alone"
"$work/alone/bin/pip" install --quiet "$wheel"
(cd "$work" && "$work/alone/bin/python" - <<'PYTHON'
import time
import numpy as np
begin = time.perf_counter()
import rotary_stand as rs
print(f"import after numpy: {1e3 * (time.perf_counter() - begin):.0f} ms")
log = rs.simulated_log("a.parquet", seconds=10, hidden="cogging", seed=3)
text = str(rs.compare({name: np.array(log[name]) for name in log}, rs.Model(["viscous", "coulomb"])))
assert "omega_rad_s" in text
PYTHON
)

part "tests"
python3 -m venv "$work/installed"
"$work/installed/bin/pip" install --quiet "$wheel[all,fleet]" duckdb pytest mypy nbclient nbformat ipykernel
cp -r python/tests python/pyproject.toml "$work"
echo 'rotary_stand._native.__all__' >"$work/allowed.txt" # pyo3 makes it, private names included
[ "$profile" != dist ] || export ROTARY_STAND_WHEEL=1 # its instructions are checked
(cd "$work" && "$work/installed/bin/python" -m pytest -q tests)

part "types"
(cd "$work" && "$work/installed/bin/mypy" --config-file pyproject.toml -p rotary_stand)
(cd "$work" && "$work/installed/bin/stubtest" rotary_stand._native --mypy-config-file pyproject.toml --concise --allowlist allowed.txt)

part "notebooks"
"$work/installed/bin/python" python/notebooks.py --check

part "example"
"$work/installed/bin/python" examples/missing-effect/missing_effect.py | diff - <(sed -n '/^without the effect/,/^```/p' examples/missing-effect/README.md | sed '$d')

part "the Python package is in order"
