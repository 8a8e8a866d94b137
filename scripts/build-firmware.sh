#!/bin/sh
# Builds the image for the NUCLEO-F446RE, holds its size against firmware/budget.toml and looks at what its interrupt can call.
set -eu
cd "$(dirname "$0")/.."
. scripts/firmware-cargo.sh

firmware_cargo build --profile chip -p stand-firmware --bin stand --features stm32
image="$firmware_folder/$firmware_target/chip/stand"
echo "$image"
python3 scripts/image-size.py "$image" firmware/budget.toml
python3 scripts/tick-callgraph.py "$image" firmware/budget.toml
