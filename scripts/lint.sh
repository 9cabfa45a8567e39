#!/usr/bin/env bash
# catkin_lint over the package, clang-format, clang-tidy and cppcheck over our sources; exit status 1 at any finding.
#   scripts/lint.sh            all
#   scripts/lint.sh FILE...    these sources only
# RIO_T_BUILD_DIR: the folder for the compile commands, else build/lint/.
set -euo pipefail
case "${1:-}" in -h | --help) sed -n '2,5s/^# \?//p' "$0"; exit 0 ;; esac
# As the lists of sources below: from the repository.
files=()
for file in "$@"; do files+=("$(realpath --relative-to="$(dirname "$0")/.." "$file")"); done
cd "$(dirname "$0")/.."
export PATH=/usr/bin:$PATH
build=${RIO_T_BUILD_DIR:-build/lint}
mkdir -p "$build"
scripts/install_dependencies.sh clang-format-14 clang-tidy-14 clang-14 cppcheck catkin-lint

# The messages' headers are all that must be made.
cmake -S . -B "$build" -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DRIO_T_FUZZ=ON \
  -DPYTHON_EXECUTABLE=/usr/bin/python3 -DPython3_EXECUTABLE=/usr/bin/python3 >"$build.log" 2>&1 || { cat "$build.log" >&2; exit 1; }
rm -f "$build.log"
cmake --build "$build" --target rio_t_generate_messages_cpp >/dev/null

if [ $# -eq 0 ]; then
  mapfile -t files < <(find include src test fuzz bench -name '*.h' -o -name '*.cpp' | sort)
fi
# Sources that this build knows: headers are seen with those that include them.
mapfile -t sources < <(printf '%s\n' "${files[@]}" | grep '\.cpp$' | while read -r file; do
  if grep -qF "\"file\": \"$PWD/$file\"" "$build/compile_commands.json"; then echo "$file"; fi
done)
if [ $# -eq 0 ] && [ ${#sources[@]} -eq 0 ]; then
  echo "lint.sh: none of ${#files[@]} files is a source that $build knows; expected all" >&2
  exit 1
fi

clean=true
catkin_lint --offline --strict --quiet . 2> >(grep -v 'rosdep\|unknown dependencies' >&2) || clean=false
clang-format-14 --dry-run --Werror "${files[@]}" || clean=false
if [ ${#sources[@]} -gt 0 ]; then  # without any, both fail
  # Our own headers, and not those that are made from the messages.
  printf '%s\0' "${sources[@]}" |
    xargs -0 -n 1 -P "$(nproc)" clang-tidy-14 --quiet -p "$build" \
      --header-filter="^$PWD/(include|src|test|fuzz|bench)/" 2> >(grep -v 'warnings\? generated\.$' >&2) || clean=false
  cppcheck --quiet --enable=warning,performance,portability --inline-suppr --std=c++17 --language=c++ --library=googletest -j "$(nproc)" \
    --error-exitcode=1 -I include "${sources[@]}" || clean=false
fi
if ! $clean; then
  echo "lint.sh: findings, see above" >&2
  exit 1
fi
echo "lint.sh: ${#files[@]} files, ${#sources[@]} of them with clang-tidy and cppcheck: no finding"
