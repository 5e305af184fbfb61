#!/usr/bin/env bash
# mcap_reader_test.sh WORK: reads WORK/run.mcap with @mcap/core of the npm registry. 77 (skipped) without it.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
package=$1/node
mkdir -p "$package"
cd "$package"
if [[ ! -d node_modules/@mcap/core ]]; then
  command -v node npm >/dev/null || { echo "needs node and npm"; exit 77; }
  timeout 40 npm install --no-save --no-audit --no-fund --prefix . @mcap/core >npm.log 2>&1 ||
    { echo "@mcap/core cannot be installed"; exit 77; }
fi
cp "$here/mcap_reader.mjs" .
node mcap_reader.mjs "$1/run.mcap" "$1/run"
