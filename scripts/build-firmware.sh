#!/bin/sh
# Builds the image for the NUCLEO-F446RE, writes it as Intel HEX beside the ELF, checks its size and stack frames against
# firmware/budget.toml, and checks the call graphs of its interrupts, of the console's parser and of the framing: none may reach a panic,
# and the interrupts no double-precision routine.
set -eu
cd "$(dirname "$0")/.."
. scripts/firmware-cargo.sh

firmware_cargo build --profile chip -p stand-firmware --bin stand --features stm32
image="$firmware_folder/$firmware_target/chip/stand"
echo "$image"
# All checks run before the script fails.
failed=0
python3 scripts/image-size.py "$image" firmware/budget.toml || failed=1
python3 scripts/image-hex.py "$image" "$image.hex" && python3 scripts/image_hex_test.py "$image" "$image.hex" || failed=1
python3 scripts/callgraph.py "$image" --frames firmware/budget.toml TIM1_UP_TIM10 USART2 || failed=1

# The library with one exported function per part, and the law of the tick on recorded inputs (chip-sim/tests/chip/replay.rs).
firmware_cargo build --profile chip -p stand-firmware --bin reach --bin replay --features reach
python3 scripts/callgraph.py "$firmware_folder/$firmware_target/chip/reach" \
    reach_tick reach_guard reach_parser:+double reach_framing_encode:+double reach_framing_decode:+double || failed=1
exit $failed
