#!/usr/bin/env bash
# Runs the onboard programs in BUILD on their samples and compares what they write.
#
# Usage: tests/prove/onboard.sh BUILD   With WRITE set what they write becomes what is expected.
set -euo pipefail
samples=$(dirname "${BASH_SOURCE[0]}")/../../examples/onboard/samples
for sample in "$samples"/*.in; do
  name=$(basename "$sample" .in)
  if [[ -n ${WRITE:-} ]]; then
    "$1/$name" <"$sample" >"$samples/$name.out"
  elif ! "$1/$name" <"$sample" | diff "$samples/$name.out" - >&2; then
    echo "$1/$name: not the expected output (< expected, > written)" >&2
    exit 1
  fi
done
