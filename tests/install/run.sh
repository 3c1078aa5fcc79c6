#!/usr/bin/env bash
# Installs the C++ package, moves it, and builds and runs the programs of consumer/ against it as a
# user of the package would: with CMake's find_package and with pkg-config, in both usual layouts of
# the library folder, the second time without exceptions and RTTI; and the programs of
# examples/onboard, one for each system.
#
# Usage: tests/install/run.sh [BUILD]   BUILD: where surefix is built already, to save doing it again
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

consumer=tests/install/consumer
work=$PWD/build/install
# Only the package under test shall be found.
unset CMAKE_PREFIX_PATH surefix_DIR surefix_ROOT PKG_CONFIG_PATH CXXFLAGS LDFLAGS

# Runs a command that talks only when it fails.
quietly() {
  local log=$work/log.$BASHPID
  "$@" >"$log" 2>&1 || { cat "$log" >&2; return 1; }
}

# Builds the library into $1, for library folder $2, as it was built before: ccache has it. (That its
# headers need no exceptions and no RTTI is tested with the headers, and by the second consumer.)
build() {
  quietly cmake -S . -B "$1" -G Ninja -DSUREFIX_TESTS=OFF -DSUREFIX_WARNINGS_AS_ERRORS=ON \
    -DCMAKE_INSTALL_LIBDIR="$2"
  quietly cmake --build "$1"
}

# Runs both programs of folder $1 and compares what they print with the expected text.
run_programs() {
  local program
  for program in onboard configured; do
    "$1/$program" | diff "$consumer/$program.txt" - || {
      echo "$1/$program: not the expected output (< expected, > printed)" >&2
      return 1
    }
  done
}

# Tests one variant: name, build of the library, its library folder, flags of the consumer.
check() {
  local name=$1 build=$2 libdir=$3 flags=$4 out=$work/$1 prefix=$work/$1/moved
  echo "$name: library in $libdir, flags: ${flags:-none}"

  # An absolute path in what was installed would still work in place, and break after the move.
  rm -rf "$work/prefix" "$prefix"
  quietly cmake --install "$build" --prefix "$work/prefix"
  mkdir -p "$out/pkg-config"
  mv "$work/prefix" "$prefix"
  if grep -rIlF -e "$work/prefix" -e "$PWD/cpp" "$prefix"; then
    echo "$name: the files above name a folder of this machine" >&2
    return 1
  fi

  quietly cmake -S "$consumer" -B "$out/cmake" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_CXX_FLAGS_RELEASE='-O1 -DNDEBUG' -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_FLAGS="$flags"
  grep -q "^surefix_DIR:.*=$prefix/$libdir/" "$out/cmake/CMakeCache.txt"
  quietly cmake --build "$out/cmake"
  run_programs "$out/cmake"
  echo "  find_package: both programs built, ran and printed what they should"

  local package
  package=$(PKG_CONFIG_PATH=$prefix/$libdir/pkgconfig pkg-config --cflags --libs 'surefix >= 0.1')
  # shellcheck disable=SC2086 # flags are words
  g++ -std=c++17 -O1 $flags "$consumer/main.cpp" $package -o "$out/pkg-config/onboard" &
  # shellcheck disable=SC2086
  g++ -std=c++17 -O1 $flags "$consumer/configured.cpp" $package -o "$out/pkg-config/configured"
  wait $!
  run_programs "$out/pkg-config"
  echo "  pkg-config: the same"
}

# The onboard programs against the package in folder $1, on their samples.
check_onboard() {
  quietly cmake -S examples/onboard -B "$work/onboard" -G Ninja -DCMAKE_PREFIX_PATH="$1" \
    -DCMAKE_CXX_FLAGS_RELEASE='-O1 -DNDEBUG'
  quietly cmake --build "$work/onboard"
  tests/prove/onboard.sh "$work/onboard"
  echo "onboard: every program built, ran and wrote what it should"
}

mkdir -p "$work"
built=${1:-$work/plain/build}
[[ $# -gt 0 ]] || build "$built" lib

bare="-fno-exceptions -fno-rtti"
build "$work/bare/build" "lib/$(uname -m)-linux-gnu" & # beside what has one core to do
building=$!
check plain "$built" lib ""
wait "$building"
check bare "$work/bare/build" "lib/$(uname -m)-linux-gnu" "$bare"
check_onboard "$work/bare/moved"
