#!/usr/bin/env bash
# An archive for people who do not compile: `stand` for every x86-64 Linux, its build for x86-64-v3, which it continues as where the processor
# allows (stand/src/processor.rs), the image of the controller, man pages, completions, licences, SHA-256. The archive is unpacked in an
# empty folder and does the main job, once with each build; both must write the same models.
# Usage: scripts/dist.sh [FOLDER]; the archive is left in FOLDER, default target/dist. The image is left out where scripts/build-firmware.sh
# has not built it.
# DIST_PROFILE=dev packs the program of `cargo run`, for this machine only.
set -euo pipefail
cd "$(dirname "$0")/.."
target="$(realpath -m "${CARGO_TARGET_DIR:-target}")"
out="$(realpath -m "${1:-$target/dist}")"
version="$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)"
name="rotary-stand-$version-x86_64-linux"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
folder="$work/$name"
mkdir -p "$folder" "$out"

if [ "${DIST_PROFILE:-dist}" = dist ]; then
    # `.cargo/config.toml` compiles for this machine. A folder for each kind of processor, the first one the wheel's, so that builds do not
    # replace each other.
    RUSTFLAGS=-Ctarget-cpu=x86-64 CARGO_TARGET_DIR="$target/baseline" cargo build --profile dist -p stand
    RUSTFLAGS=-Ctarget-cpu=x86-64-v3 CARGO_TARGET_DIR="$target/x86-64-v3" cargo build --profile dist -p stand
    cp "$target/baseline/dist/stand" "$folder/stand"
    mkdir "$folder/lib"
    cp "$target/x86-64-v3/dist/stand" "$folder/lib/stand-$version-x86-64-v3"
else
    cargo build -p stand
    cp "$target/debug/stand" "$folder/stand"
fi
"$folder/stand" man --out "$folder/man" >/dev/null
mkdir "$folder/completions"
for shell in bash zsh fish powershell elvish; do
    "$folder/stand" completions "$shell" >"$folder/completions/stand.$shell"
done
image="$target/firmware/thumbv7em-none-eabihf/chip/stand"
if [ -f "$image" ]; then
    mkdir "$folder/firmware"
    cp "$image" "$folder/firmware/stand.elf"
    cp "$image.hex" "$folder/firmware/stand.hex"
else
    echo "without the image: scripts/build-firmware.sh builds it"
fi
cp LICENSE-APACHE LICENSE-MIT README.md CHANGELOG.md "$folder"
python3 scripts/third-party-licences.py >"$folder/LICENCES-THIRD-PARTY.txt"
(cd "$folder" && find . -type f ! -name SHA256SUMS -printf '%P\0' | sort -z | xargs -0 sha256sum >SHA256SUMS)
tar --sort=name --owner=0 --group=0 --numeric-owner -C "$work" -czf "$out/$name.tar.gz" "$name"
(cd "$out" && sha256sum "$name.tar.gz" >"$name.tar.gz.sha256")
printf '%s: %d KB, stand %d KB\n' "$out/$name.tar.gz" "$(($(stat -c %s "$out/$name.tar.gz") / 1024))" "$(($(stat -c %s "$folder/stand") / 1024))"

# As somebody who has the archive alone.
mkdir "$work/empty"
(
    cd "$work/empty"
    (cd "$out" && sha256sum --check --quiet "$name.tar.gz.sha256")
    tar -xzf "$out/$name.tar.gz"
    (cd "$name" && sha256sum --check --quiet SHA256SUMS)
    mkdir as-unpacked without-lib
    (cd as-unpacked && env -i HOME="$work/empty" "../$name/stand" >session.txt)
    for page in nominal.html fitted.html explained.html; do
        grep -q '</html>' "as-unpacked/out/$page"
    done
    grep -q "Missing effect" as-unpacked/session.txt
    if [ -d "$name/lib" ]; then
        mv "$name/lib" lib
        (cd without-lib && env -i HOME="$work/empty" "../$name/stand" >session.txt)
        # Pages and the log hold the date; the text has the time that was needed.
        text() { sed 's/computed in .*//' "$1/session.txt"; }
        diff <(text as-unpacked) <(text without-lib)
        for model in nominal fitted explained; do
            diff "as-unpacked/out/$model.toml" "without-lib/out/$model.toml"
        done
    fi
)
echo "the unpacked archive runs the main job"
