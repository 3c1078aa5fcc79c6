#!/usr/bin/env bash
# Proves what surefix promises (docs/promises.md): one line for each proof, with its figure.
#
# Usage: tests/prove/run.sh [--quick] [NAME…]
#   --quick: seconds each, with the build in build/cpp; only the proofs that can be had so
#   NAME: numerics same_bits no_heap soak sanitizers coverage package onboard risk fuzz promises
# Logs lie in build/prove. MINUTES (10) is how long each fuzzer runs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

work=$PWD/build/prove
minutes=${MINUTES:-10}
python=$PWD/.venv/bin/python
pytest=(env OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1
  "$python" -m pytest -q -n "$(nproc)" --dist loadfile --max-worker-restart=0)
quick=
[[ ${1:-} != --quick ]] || { quick=yes; shift; }
# What malloc keeps for later counts as in use: it keeps nothing, or `soak` would see it grow.
export GLIBC_TUNABLES=glibc.malloc.tcache_count=0:glibc.malloc.mxfast=0
# Only this project's own flags.
unset CXXFLAGS LDFLAGS CMAKE_PREFIX_PATH

# What is proved: figures of another state of the code do not count.
revision() { git describe --always --dirty --abbrev=40 2>/dev/null || echo "no revision"; }
# Configures a preset into build/PRESET and builds the targets named after it.
preset() {
  cmake --preset "$1"
  cmake --build "build/$1" ${2:+--target "${@:2}"}
}
# The folder of the build that a quick proof uses, and a long one makes.
programs() { echo "build/$([[ -n $quick ]] && echo cpp || echo release)"; }
# Runs a program for as long as is quick, or as is not; its last line is the figure.
run_program() {
  figure=$("$(programs)/tests/prove/$1" "$([[ -n $quick ]] && echo "$2" || echo "$3")" |
    tee -a /dev/stderr | tail -1)
}
need_programs() { [[ -n $quick ]] || preset release; }

prove_numerics() {
  need_programs
  run_program surefix_numerics 1000000 100000000
}

prove_soak() {
  need_programs
  run_program surefix_soak 0.05 24
}

prove_no_heap() {
  need_programs
  local log=$work/no_heap.txt
  "$(programs)/tests/cpp/surefix_no_heap_test" >"$log"
  figure="$(grep '^\[       OK \]' "$log" | grep -vc TheCounter) systems, no allocation in a step"
}

# The replays of tests/golden with every compiler and level of optimisation; one of them for Python
# is in tests/python.
prove_same_bits() {
  if [[ -n $quick ]]; then
    build/cpp/tests/cpp/surefix_golden
    figure="5 replays as committed"
    return
  fi
  local compiler level ways=0
  for compiler in g++ clang++; do
    for level in O0 O2 O3; do
      local build=build/bits-$compiler-$level
      CXX=$compiler cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=None -DSUREFIX_TESTS=ON \
        -DCMAKE_CXX_FLAGS="-$level"
      cmake --build "$build" --target surefix_golden
      "$build/tests/cpp/surefix_golden"
      ways=$((ways + 1))
    done
  done
  figure="5 replays as committed, $ways ways compiled (g++, clang++; O0, O2, O3)"
}

# One fuzzer for its time; what it did lies in its log.
run_fuzzer() {
  local name
  name=$(basename "$1")
  mkdir -p "$work/$name"
  "$1" -max_total_time=$((minutes * 60)) -timeout=10 -max_len=4096 -print_final_stats=1 \
    -artifact_prefix="$work/$name-" "$work/$name" >"$work/$name.txt" 2>&1 ||
    { tail -40 "$work/$name.txt"; return 1; }
}

prove_fuzz() {
  preset fuzz
  local fuzzer fuzzers=() name runs=
  for fuzzer in build/fuzz/tests/fuzz/fuzz_*; do
    [[ ! -x $fuzzer || ! -f $fuzzer ]] || fuzzers+=("$fuzzer")
  done
  export work minutes
  export -f run_fuzzer
  printf '%s\0' "${fuzzers[@]}" | xargs -0 -n 1 -P "$(nproc)" bash -c 'run_fuzzer "$1"' _
  for fuzzer in "${fuzzers[@]}"; do
    name=$(basename "$fuzzer")
    runs+="${runs:+, }$(sed -n 's/^stat::number_of_executed_units: *//p' "$work/$name.txt") of ${name#fuzz_}"
  done
  # The readers of files, through Python.
  "${pytest[@]}" tests/python/test_fuzz_readers.py --hypothesis-profile=long \
    >"$work/fuzz_readers.txt" || { tail -40 "$work/fuzz_readers.txt"; return 1; }
  figure="$minutes minutes each, nothing found: $runs inputs; \
$(grep -oE '[0-9]+ passed' "$work/fuzz_readers.txt" | cut -d' ' -f1) readers of files with 20000 inputs each"
}

# A preset with the extension for Python, and its C++ tests.
preset_with_python() {
  cmake --preset "$1" -DSUREFIX_BINDINGS=ON -DPython_EXECUTABLE="$python" \
    -Dpybind11_DIR="$("$python" -m pybind11 --cmakedir)"
  cmake --build "build/$1" --target surefix_tests surefix_golden surefix_no_heap_test _core
}
# All tests of a preset: ctest, then pytest with its extension and VAR=VALUE… in the environment.
all_tests() {
  local build=$PWD/build/$1
  ctest --test-dir "$build" --output-on-failure --no-tests=error -j "$(nproc)"
  rm -rf "$build/python"
  mkdir "$build/python"
  cp -r python/surefix "$build/python/"
  cp "$build"/bindings/_core.*.so "$build/python/surefix/"
  rm -f "$work/pytest-$1."*
  # What a sanitizer says as it ends a worker of pytest would be lost, but for its own files.
  local suppressed=
  [[ $1 != tsan ]] || suppressed=suppressions=$PWD/tests/prove/tsan.supp
  env "${@:2}" {A,UB,T}SAN_OPTIONS="halt_on_error=1:detect_leaks=0:print_stacktrace=1:\
log_path=$work/pytest-$1:$suppressed" PYTHONPATH="$build/python" "${pytest[@]}" >"$work/pytest-$1.txt" ||
    { tail -n 40 "$work/pytest-$1."*; return 1; }
}
count_tests() {
  echo "$(ctest --test-dir "build/$1" -N | sed -n 's/^Total Tests: //p') C++ tests and" \
    "$(grep -oE '[0-9]+ passed' "$work/pytest-$1.txt" | cut -d' ' -f1) of pytest"
}

# With the C++ library: a sanitizer that comes before it does not find how to throw.
preloaded() { echo "$(g++ -print-file-name="$1") $(g++ -print-file-name=libstdc++.so)"; }

# Python's own leaks are not ours: leaks are looked for in the C++ suite. PYTHONMALLOC: each array is
# a block of its own, which the sanitizers see.
prove_sanitizers() {
  preset_with_python asan-ubsan
  all_tests asan-ubsan PYTHONMALLOC=malloc LD_PRELOAD="$(preloaded libasan.so)"
  preset_with_python tsan
  all_tests tsan PYTHONMALLOC=malloc LD_PRELOAD="$(preloaded libtsan.so)"
  figure="$(count_tests tsan) under ASan, UBSan and TSan"
}

prove_coverage() {
  local build=$PWD/build/coverage programs object
  preset_with_python coverage
  rm -f "$build"/*.profraw
  export LLVM_PROFILE_FILE="$build/%4m.profraw" # into four files, whatever number of processes
  all_tests coverage
  programs=("$build"/tests/cpp/surefix_{tests,golden,no_heap_test} "$build"/bindings/_core.*.so)
  llvm-profdata merge -o "$build/coverage.profdata" "$build"/*.profraw
  for object in "${programs[@]:1}"; do programs+=(-object "$object"); done
  set -- "${programs[0]}" "${programs[@]:4}" -instr-profile "$build/coverage.profdata" \
    -ignore-filename-regex="^(/usr/(include|lib)|$PWD/(\.venv|tests|bindings))/"
  llvm-cov export -format=lcov "$@" >"$work/coverage.lcov"
  llvm-cov export -format=text -skip-functions -skip-expansions "$@" >"$work/coverage.json"
  rm -f "$work/coverage.txt"
  figure=$("$python" tests/prove/coverage.py "$work/coverage.lcov" "$work/coverage.json" |
    tee -a "$work/coverage.txt" /dev/stderr | tail -1)
}

# The installed package with each compiler and standard, and every onboard program against it.
prove_package() {
  preset no-exceptions
  mkdir -p build/docs
  doxygen docs/Doxyfile # whose warnings are errors
  tests/install/run.sh
  local compiler standard source program ways=0
  for compiler in g++ clang++; do
    for standard in 17 20; do
      local build=$PWD/build/consumer-$compiler-$standard
      for source in tests/install/consumer examples/onboard; do
        cmake -S "$source" -B "$build/$source" -G Ninja -DCMAKE_CXX_COMPILER="$compiler" \
          -DCMAKE_CXX_STANDARD="$standard" -DCMAKE_PREFIX_PATH="$PWD/build/install/plain/moved"
        cmake --build "$build/$source"
      done
      for program in onboard configured; do
        "$build/tests/install/consumer/$program" | diff "tests/install/consumer/$program.txt" -
      done
      tests/prove/onboard.sh "$build/examples/onboard"
      ways=$((ways + 1))
    done
  done
  figure="6 programs built and run against the installed package, $ways ways (g++, clang++; C++17, C++20)"
}

prove_onboard() {
  figure=$("$python" benchmarks/onboard.py --brief)
}

# What alert limits claim, against what is measured.
prove_risk() {
  figure=$("$python" tests/prove/risk.py | tee -a /dev/stderr | tail -1)
}

# Last: one line for each promise, of the tests that its rows name and of the proofs above (as they
# were last run, of the same revision).
prove_promises() {
  preset release
  ctest --test-dir build/release --no-tests=error -j "$(nproc)" --output-junit "$work/ctest.xml"
  "${pytest[@]}" --junitxml="$work/pytest.xml" -o junit_family=xunit1 # the later one has no properties
  "$python" tests/prove/promises.py "$work" "$(revision)" >"$work/promises.txt" ||
    { cat "$work/promises.txt"; return 1; }
  figure="one line each"$'\n'"$(sed 's/^/  /' "$work/promises.txt")"
}

if [[ -n $quick ]]; then all=(numerics same_bits no_heap soak); else
  all=(numerics same_bits no_heap soak sanitizers coverage package onboard risk fuzz promises)
fi
kind=${quick:+quick.}figure # `promises` reads the long proofs' alone
proofs=("${@:-${all[@]}}")
mkdir -p "$work"
for proof in "${proofs[@]}"; do
  declare -F "prove_$proof" >/dev/null || { echo "no proof '$proof'" >&2; exit 2; }
done
failed=0
for proof in "${proofs[@]}"; do
  begin=$SECONDS
  rm -f "$work/$proof.$kind" "$work/$proof.log"
  # In a shell of its own that stops at the first failure, which an `if` around it would hide.
  (set -e; figure=; "prove_$proof"; echo "$figure" >"$work/$proof.$kind"
    revision >"$work/$proof.${kind%figure}revision") >>"$work/$proof.log" 2>&1 &
  if wait $!; then
    printf '%-11s ok %6d s  %s\n' "$proof" $((SECONDS - begin)) "$(cat "$work/$proof.$kind")"
  else
    failed=1
    printf '%-11s FAILED       see %s\n' "$proof" "$work/$proof.log"
    tail -5 "$work/$proof.log" | sed 's/^/    /'
  fi
done
exit "$failed"
