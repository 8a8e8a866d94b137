#!/bin/sh
# Builds the image for the NUCLEO-F446RE and holds its size against firmware/budget.toml.
# Uses rustup's target where it is installed, else Debian's compiler with the core library built from its source.
set -eu
cd "$(dirname "$0")/.."

target=thumbv7em-none-eabihf
build="build --release -p stand-firmware --bin stand --features stm32 --target $target"
folder="${CARGO_TARGET_DIR:-target}"

# Debian's compiler, as new as the workspace asks for (package lists that were never brought up to date name an older one).
needed="$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)"
debian_compiler() {
    [ -x /usr/bin/rustc ] && [ -x /usr/bin/cargo ] && [ -d /usr/lib/rustlib/src/rust/library/core ] && command -v ld.lld >/dev/null 2>&1 &&
        printf '%s\n' "$needed" "$(/usr/bin/rustc --version | cut -d' ' -f2)" | sort -V -C
}

if command -v rustup >/dev/null 2>&1 && rustup target list --installed 2>/dev/null | grep -qx "$target"; then
    cargo $build
else
    if ! debian_compiler && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
        export DEBIAN_FRONTEND=noninteractive
        apt-get update -qq && apt-get install -y -qq rustc-web cargo-web rust-web-src rust-web-llvm lld || true
    fi
    if ! debian_compiler; then
        echo "The image cannot be built here. Either 'rustup target add $target'," >&2
        echo "or, on Debian, 'apt-get install rustc-web cargo-web rust-web-src rust-web-llvm lld'." >&2
        exit 1
    fi
    # Two compilers in one folder would build everything anew at each turn.
    folder="$folder/firmware"
    # Debian's compiler is a stable one; RUSTC_BOOTSTRAP lets it build its own core library for the chip.
    RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER=ld.lld CARGO_TARGET_DIR="$folder" \
        /usr/bin/cargo $build -Zbuild-std=core
fi

image="$folder/$target/release/stand"
echo "$image"
python3 scripts/image-size.py "$image" firmware/budget.toml
python3 scripts/tick-callgraph.py "$image" firmware/budget.toml
