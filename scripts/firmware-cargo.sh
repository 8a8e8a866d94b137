# Cargo for the chip, sourced by build scripts: `firmware_cargo build …` and `$firmware_folder`, the target folder in use. Uses rustup's
# target if installed, else Debian's compiler with the core library built from source.

firmware_target=thumbv7em-none-eabihf
firmware_folder="${CARGO_TARGET_DIR:-target}"

# Debian's compiler must meet the workspace's rust-version (outdated package lists name an older one).
debian_compiler() {
    [ -x /usr/bin/rustc ] && [ -x /usr/bin/cargo ] && [ -d /usr/lib/rustlib/src/rust/library/core ] && command -v ld.lld >/dev/null 2>&1 &&
        printf '%s\n' "$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)" "$(/usr/bin/rustc --version | cut -d' ' -f2)" | sort -V -C
}

if command -v rustup >/dev/null 2>&1 && rustup target list --installed 2>/dev/null | grep -qx "$firmware_target"; then
    firmware_cargo() { cargo "$@" --target "$firmware_target"; }
else
    if ! debian_compiler && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
        export DEBIAN_FRONTEND=noninteractive
        apt-get update -qq && apt-get install -y -qq rustc-web cargo-web rust-web-src rust-web-llvm lld || true
    fi
    if ! debian_compiler; then
        echo "Nothing can be built for the chip here. Either 'rustup target add $firmware_target'," >&2
        echo "or, on Debian, 'apt-get install rustc-web cargo-web rust-web-src rust-web-llvm lld'." >&2
        exit 1
    fi
    # Separate folders, because two compilers in one folder rebuild everything at each change.
    firmware_folder="$firmware_folder/firmware"
    # RUSTC_BOOTSTRAP lets Debian's stable compiler build its own core library for the chip.
    firmware_cargo() {
        RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER=ld.lld CARGO_TARGET_DIR="$firmware_folder" \
            /usr/bin/cargo "$@" --target "$firmware_target" -Zbuild-std=core
    }
fi
