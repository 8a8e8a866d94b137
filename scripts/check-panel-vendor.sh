#!/usr/bin/env bash
# The vendored plot library of `stand panel` is the one that its project publishes: its files are compared with those of the package on npm.
# Needs npm and the network.
set -euo pipefail
vendor="$(cd "$(dirname "$0")/../stand-panel/page/vendor" && pwd)"
version=1.6.32
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
(cd "$vendor" && sha256sum --check --quiet SHA256SUMS)
(cd "$folder" && npm pack --silent "uplot@$version" >/dev/null && tar xzf "uplot-$version.tgz")
for file in uPlot.esm.js uPlot.min.css uPlot.d.ts; do
    cmp "$vendor/$file" "$folder/package/dist/$file"
done
cmp "$vendor/uPlot-LICENSE" "$folder/package/LICENSE"
echo "uPlot $version: the vendored files are those of the package"
