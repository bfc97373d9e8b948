#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

# Makes a virtual environment of lock files, or says in one sentence what is missing. What is not in
# them, or has another hash there, is refused. Lock files are complete, so pip resolves nothing
# (--no-deps): its resolver may choose a release that is newer than the lock file.
#
#   about='what it is' wheels/install.sh [--to-compile | --from-source] PYTHON FOLDER LOCK...
#
# Some come as source; --to-compile: with extensions in C.

source=
case $1 in --to-compile | --from-source) source=$1; shift;; esac
python=$1 folder=$2
shift 2
log=$folder/pip.log
export PIP_RETRIES=${PIP_RETRIES-2}

stop() { echo "$*" >&2; exit 1; }
holds() { "$python" -c "import sys, sysconfig, os.path; sys.exit(not ($1))" 2>/dev/null; }

range='Python from 3.10 to 3.14'
[ -n "$python" ] || stop "No $range was found: install one, or name it with PYTHON=."
command -v "$python" >/dev/null || stop "PYTHON=$python is no command: name a $range."
holds True || stop "PYTHON=$python is no Python that runs: name a $range."
holds '(3, 10) <= sys.version_info < (3, 15)' \
  || stop "$python is $("$python" -V 2>&1), but a $range is needed: name one with PYTHON=."
"$python" -c 'import ensurepip, venv' 2>/dev/null \
  || stop "$python lacks venv: install python3-venv, or name another with PYTHON=."
if [ "$source" = --to-compile ]; then
  holds 'os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h"))' \
    || stop "$python lacks its headers: install python3-dev, or name another with PYTHON=."
  for compiler in "${CC:-cc}" "${CXX:-c++}"; do
    command -v ${compiler%% *} >/dev/null \
      || stop "The compiler $compiler is missing: install gcc and g++."
  done
fi

echo "Installing $about"
mkdir -p "$folder"
"$folder/bin/python" -m pip --version >/dev/null 2>&1 \
  || "$python" -m venv "$folder" >"$log" 2>&1 \
  || stop "The virtual environment $folder cannot be made: $(tail -n 1 "$log")"
for file; do files+=(-r "$file"); done
install() {
  "$folder/bin/python" -m pip install -q --no-deps --require-hashes --no-build-isolation "$@" \
    >"$log" 2>&1
}
[ "$source" ] && install -r "${0%/*}/lock/source.txt"
install "${files[@]}" && exit
if grep -qiE 'connection (broken|refused|reset)|new connection|name resolution|timed out|proxy' \
    "$log"; then
  stop "The Python package index cannot be reached: is there a network? (All of it: $log)"
fi
if grep -q 'DO NOT MATCH THE HASHES' "$log"; then
  stop "Refused: $(grep -m 1 'from http\|from file' "$log") has another hash than in $*. (All of it: $log)"
fi
stop "pip cannot install what is in $*: $(grep -m 1 ERROR "$log") (All of it: $log)"
