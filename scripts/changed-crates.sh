#!/usr/bin/env bash
# Format, lints and tests of the crates that changed since a commit (default HEAD: what is not committed), for the inner loop.
# The libraries' own tests of these crates run, and their test programs but for `processes`, `panel` and `lab`, which `cargo test --workspace` has.
# Usage: scripts/changed-crates.sh [COMMIT]
set -euo pipefail
cd "$(dirname "$0")/.."
changed=$( (git diff --name-only "${1:-HEAD}"; git ls-files --others --exclude-standard) | sort -u)
crates=()
for manifest in */Cargo.toml; do
    folder=$(dirname "$manifest")
    if grep -q "^$folder/.*\.\(rs\|toml\|js\|css\|html\)$" <<<"$changed"; then
        crates+=(-p "$(sed -n 's/^name = "\(.*\)"/\1/p' "$manifest" | head -n 1)")
    fi
done
if [ ${#crates[@]} = 0 ]; then
    echo "no crate has changed since ${1:-HEAD}"
    exit
fi
echo "${crates[@]}"
cargo fmt --all --check
cargo clippy --all-targets "${crates[@]}" -- -D warnings
cargo test --lib --bins "${crates[@]}"
