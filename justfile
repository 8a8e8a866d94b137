# Recipes of the project; each line works without just, too. `just` lists them.

# shows the recipes
default:
    @just --list

# format, lints and tests of the crates that changed since the last commit; `just fast main` since a branch
fast since="HEAD":
    scripts/changed-crates.sh {{since}}

# all tests that need nothing but cargo
test *arguments:
    cargo test --workspace {{arguments}}

# one or several steps of the checks, or all: `just ci`, `just ci tests panel`, `just ci --list`
ci *steps:
    .ci/run {{steps}}

# runs the logs of a set and compares the answers with the accepted ones: `just campaign explain`, `just campaign coverage`, `just campaign planted`
campaign *arguments:
    cargo run -p stand-tests --bin campaign -- {{arguments}}

# compares the last run of a set with the accepted answers
campaign-diff *arguments:
    cargo run -p stand-tests --bin campaign -- diff {{arguments}}

# the image of the controller, its budget and its call graphs
firmware:
    scripts/build-firmware.sh

# the printed pages: docs/figures.md from the baselines
docs:
    cargo run -p stand-tests --bin campaign -- figures
