# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

# linkage_ros without an installed ROS: ROS 2 comes as wheels from the Python package index, in a
# virtual environment beside the sources. Where a ROS 2 is sourced, use `colcon build` instead.

SHELL := /bin/bash
.DEFAULT_GOAL := help

DISTRO ?= kilted
ifeq ($(wildcard wheels/$(DISTRO).txt),)
$(error DISTRO is '$(DISTRO)', but must be kilted or jazzy)
endif

suffix := $(if $(filter kilted,$(DISTRO)),,-$(DISTRO))$(if $(PLAIN),-plain)
venv := .venv$(suffix)
build := build$(suffix)
install := install$(suffix)
log := log$(suffix)
bin := $(CURDIR)/$(venv)/bin
docs_python := $(CURDIR)/.venv-docs/bin/python
lint_bin := .venv-lint/bin

# All that is installed, with hashes: `make lock` writes these files.
lock := wheels/lock
requirements := $(lock)/$(DISTRO).txt $(if $(PLAIN),,$(lock)/fast.txt)
tools := $(lock)/dev-$(DISTRO).txt
sources := package.xml setup.py setup.cfg resource/linkage_ros wheels/prefix.cmake \
  $(shell find linkage_ros config examples launch linkage_interfaces -type f ! -name '*.pyc' 2>/dev/null)

# The first Python that is new enough for the wheels and can build against itself; without any, the
# first that is new enough.
ifndef PYTHON
new := import ensurepip, sys; assert (3, 10) <= sys.version_info < (3, 15)
whole := $(new); import os, sysconfig; \
  assert os.path.exists(os.path.join(sysconfig.get_path('include'), 'Python.h'))
PYTHON := $(shell for code in "$(whole)" "$(new)"; do \
  for python in python3.12 python3.11 python3.13 python3.10 python3.14 python3; do \
  $$python -c "$$code" 2>/dev/null && echo $$python && exit; done; done)
endif

# No other ROS than this one, and no talk with other machines.
unexport AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH
unexport PYTHONDONTWRITEBYTECODE
export RMW_IMPLEMENTATION := rmw_fastrtps_cpp
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
export PATH := $(bin):$(PATH)
in_ros := source $(install)/setup.bash &&

.PHONY: help
help: ## Show what can be made
	@echo 'make TARGET [DISTRO=kilted|jazzy] [PYTHON=python3.x] [PLAIN=1: without llvmlite]'
	@sed -n 's/^\([a-z]*\):.*## /  \1\t/p' $(firstword $(MAKEFILE_LIST))

.PHONY: demo
demo: build ## Run the nodes, measure what they send, draw it to demo/out/
	@$(in_ros) PYTHONPATH=$$PYTHONPATH:test python demo/demo.py

# What `make view` shows, and where.
SCENE ?= config/all.yaml
PORT ?= 8020

.PHONY: view
view: build ## Show SCENE=config/all.yaml in the browser, at PORT=8020
	@$(in_ros) PYTHONPATH=$$PYTHONPATH:test exec python demo/view.py '$(SCENE)' '$(PORT)'

# Pages are written by the same commands with --document, of a commit alone.
.PHONY: bench
bench: ready .venv-bench/.installed ## Measure run time against error, stability, inverses, rods, calls, nodes, C
	@.venv-bench/bin/python -m benchmark.run
	@.venv-bench/bin/python -m benchmark.stability --samples 500 --linkages 50
	@.venv-bench/bin/python -m benchmark.inverse_rule --linkages 50 --minutes 5
	@.venv-bench/bin/python -m benchmark.rods --ankles 2 --pairs 20000
	@$(in_ros) python -m benchmark.calls
	@$(in_ros) python -m benchmark.nodes --quick
	@$(in_ros) python -m benchmark.c_code

.PHONY: verify
verify: .venv-bench/.installed ## Compare with pylinkage, MuJoCo and, with PMKS=FOLDER, a clone of PMKS_Verification
	@.venv-bench/bin/python -m benchmark.verify $(if $(PMKS),--pmks '$(PMKS)')

.PHONY: pictures
pictures: .venv-docs/.installed ## Draw what pictures/pictures.txt lists, without ROS
	@mkdir -p pictures/out
	@grep -v '^#' pictures/pictures.txt | xargs -t -L 1 $(docs_python) -m linkage_ros.render
	@PYTHONPATH=. $(docs_python) examples/draw_leg.py pictures/out/leg.png
	@PYTHONPATH=. $(docs_python) docs/figures.py pictures/out

.PHONY: docs
docs: .venv-docs/.installed ## Build the documentation to docs/_build/html/; a broken link is an error
	@cd docs && COLUMNS=80 NO_COLOR=1 $(docs_python) -m sphinx -q -W --keep-going -b html . _build/html
	@echo 'Documentation: docs/_build/html/index.html'

# What else is installed for pytest, such as colcon's repetitions, only takes its time.
pytest = PYTEST_DISABLE_PLUGIN_AUTOLOAD=1 PYTEST_PLUGINS=xdist.plugin,slipcover.pytest_plugin \
  ROS_PYTHON_CHECK_FIELDS=1 python $(measuring) -m pytest -n 2 --dist worksteal -p no:logging

.PHONY: test
test: ready ## Run the tests, but for the nightly ones
	@$(in_ros) $(pytest) -m 'not nightly'

.PHONY: coverage
coverage: measuring := -m slipcover --source linkage_ros --json --out $(build)/coverage.json
coverage: test ## Run them a tenth slower, and fail where they run too few lines
	@python .ci/coverage.py $(build)/coverage.json

# What starts nodes runs alike without machine code.
.PHONY: nodes
nodes: ready ## Run the tests of the nodes alone; with PLAIN=1 where llvmlite is not installed
	@$(if $(PLAIN),! python -c 'import llvmlite' 2>/dev/null)
	@$(in_ros) $(pytest) -m 'not nightly' $$(grep -lE 'ros_harness|\(graph' test/test_*.py)

.PHONY: nightly
nightly: ready ## Run the nightly tests: sweeps and long ways
	@$(in_ros) $(pytest) -m nightly

# Some minutes to an hour a room, and some minutes once for a state of the checkout.
.PHONY: mutants
mutants: ready .venv-mutants/.installed ## Put COUNT=40 random bugs into ROOM=scene; SEED=2: others; AGAIN=file: only what survived there
	@$(in_ros) nice -n 10 python test/mutants.py --out $(build)/mutants \
	  --room '$(ROOM)' --count $(or $(COUNT),40) --seed $(or $(SEED),1) $(if $(AGAIN),--again '$(AGAIN)')

.PHONY: lint
lint: .venv-lint/.installed ## Check style, types and licences
	@$(lint_bin)/ruff check .
	@$(lint_bin)/mypy
	@$(lint_bin)/oxlint linkage_ros/web/page
	@$(lint_bin)/reuse lint -q
	@$(lint_bin)/python -c 'import sys; from xml.dom.minidom import parse; [parse(f) for f in sys.argv[1:]]' \
	  package.xml linkage_interfaces/package.xml

.PHONY: ctidy
ctidy: ready ## Check the C that is printed with clang-tidy and cppcheck, which have to be installed
	@$(in_ros) .ci/ctidy

.PHONY: lock
lock: .venv-lock/.installed ## Pin with hashes what wheels/*.txt ask for; UPGRADE=1: to the newest
	@wheels/lock.sh $(if $(UPGRADE),--upgrade)

.PHONY: build
build: $(install)/.built ## Build both packages

.PHONY: ready
ready: build $(venv)/.tools ## Build, and install what the tests need

.PHONY: clean
clean: ## Remove everything that was made
	rm -rf .venv .venv-* build build-* install install-* log log-* demo/out pictures/out \
	  docs/_build docs/mechanisms benchmark/.cache .hypothesis .mypy_cache .pytest_cache .ruff_cache *.egg-info
	find . -name __pycache__ -prune -exec rm -rf {} +

# What building against wheels needs besides; setup.py builds the nested package, with this as well.
cmake_args := -DBUILD_TESTING=OFF -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=$(CURDIR)/$(venv) \
  -DCMAKE_PROJECT_INCLUDE=$(CURDIR)/wheels/prefix.cmake -DPython3_EXECUTABLE=$(bin)/python

$(install)/.built: $(venv)/.installed $(sources)
	@echo 'Building linkage_interfaces and linkage_ros: a minute, once.'
	@mkdir -p $(build)
	@printf 'build:\n  cmake-args:\n' >$(build)/colcon.yaml
	@printf '  - %s\n' $(cmake_args) >>$(build)/colcon.yaml
	@COLCON_DEFAULTS_FILE=$(CURDIR)/$(build)/colcon.yaml colcon --log-base $(log) build \
	  --build-base $(build) --install-base $(install) --event-handlers console_start_end- summary-
	@touch $@

$(venv)/.installed: $(requirements)
	@about='ROS 2 $(DISTRO) into $(venv): about a minute, once.' wheels/install.sh --to-compile \
	  '$(PYTHON)' $(venv) $(requirements)
	@touch $@

$(venv)/.tools: $(venv)/.installed $(tools)
	@about='what the tests need.' wheels/install.sh '$(bin)/python' $(venv) $(requirements) $(tools)
	@touch $@

# Environments beside that of the nodes, each of one lock file.
.venv-bench/.installed: private export about := what there is to compare with: some minutes, once.
.venv-docs/.installed: private export about := what draws and what makes the pages.
.venv-lint/.installed: private export about := what checks style and types.
.venv-lock/.installed: private export about := what pins the rest.
.venv-mutants/.installed: private export about := what puts bugs into the package.
# A package of these comes as source, reuse for Python 3.11 and newer.
.venv-lint/.installed: private from_source := --from-source
.venv-mutants/.installed: private from_source := --to-compile
.venv-bench/.installed .venv-docs/.installed .venv-lint/.installed .venv-lock/.installed .venv-mutants/.installed: \
.venv-%/.installed: $(lock)/%.txt
	@wheels/install.sh $(from_source) '$(PYTHON)' .venv-$* $<
	@touch $@
