#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

# Writes wheels/lock/*.txt: what the requirement files ask for and all that this brings along, each
# with the hashes of its files, for every Python from the one that is named.
#
#   wheels/lock.sh [--upgrade]
#
# What is pinned already stays, unless it is asked for otherwise; --upgrade takes the newest.

set -e
shopt -s nullglob
cd "$(dirname "$0")/.."
upgrade=$1

pin() {
  name=$1 python=$2
  shift 2
  echo "wheels/lock/$name.txt"
  .venv-lock/bin/uv pip compile --quiet --universal --generate-hashes --no-header $upgrade \
    --python-version "$python" --output-file "wheels/lock/$name.txt" "$@" > /dev/null
}

pin lock 3.10 wheels/lock.txt
pin source 3.10 wheels/source.txt
pin fast 3.10 wheels/fast.txt
pin lint 3.10 wheels/lint.txt
pin mutants 3.10 wheels/mutants.txt
pin docs 3.10 docs/requirements.txt
pin bench 3.11 benchmark/requirements.txt
for distro in kilted jazzy; do
  pin $distro 3.10 wheels/{$distro,build,demo}.txt
  pin dev-$distro 3.10 wheels/dev.txt wheels/dev-$distro*.txt --constraint wheels/lock/$distro.txt
done
