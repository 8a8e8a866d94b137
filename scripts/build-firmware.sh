#!/bin/sh
# Builds the image for the NUCLEO-F446RE, holds its size against firmware/budget.toml, and looks at what its interrupts, the console's parser and
# the framing can call: no panic, and in the interrupts nothing in double precision.
set -eu
cd "$(dirname "$0")/.."
. scripts/firmware-cargo.sh

firmware_cargo build --profile chip -p stand-firmware --bin stand --features stm32
image="$firmware_folder/$firmware_target/chip/stand"
echo "$image"
# All that is wrong is told before it fails.
failed=0
python3 scripts/image-size.py "$image" firmware/budget.toml || failed=1
most="$(sed -n 's/^greatest_instructions = \([0-9]*\)$/\1/p' firmware/budget.toml)"
python3 scripts/callgraph.py "$image" "TIM1_UP_TIM10:$most" USART2 || failed=1

# The same library, with doors to its parts.
firmware_cargo build --profile chip -p firmware-count --bin reach --features qemu
python3 scripts/callgraph.py "$firmware_folder/$firmware_target/chip/reach" \
    reach_tick reach_guard reach_parser:+double reach_framing_encode:+double reach_framing_decode:+double || failed=1
exit $failed
