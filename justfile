# Recipes of the project; each line works without just, too. `just` lists them.

# shows the recipes
default:
    @just --list

# format, lints and the libraries' own tests, of what has changed: cargo knows
fast:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets -- -D warnings
    cargo test --workspace --lib --bins

# all tests that need nothing but cargo
test *arguments:
    cargo test --workspace {{arguments}}

# one or several steps of the checks, or all: `just ci`, `just ci tests panel`, `just ci --list`
ci *steps:
    .ci/run {{steps}}

# runs a campaign and compares it with the accepted results: `just campaign explain`, `coverage` or `planted`
campaign *arguments:
    cargo run -p stand-tests --bin campaign -- {{arguments}}

# compares the last run with the accepted results: `just campaign-diff --set coverage`
campaign-diff *arguments:
    cargo run -p stand-tests --bin campaign -- diff {{arguments}}

# the image of the controller, its budget and its call graphs
firmware:
    scripts/build-firmware.sh

# the printed page docs/figures.md, from tests/baselines
docs:
    cargo run -p stand-tests --bin campaign -- figures > docs/figures.md
