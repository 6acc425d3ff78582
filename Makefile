# Two commands on a fresh machine: `make run` and `make test`. Each sets up what it needs in .venv first.
# Only Python 3.10 or 3.11, pip and make are assumed. Every recipe runs in this folder, whatever its path.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help

# What is set in the caller's shell must not leak into the environment made here.
unexport VIRTUAL_ENV PYTHONPATH PYTHONHOME

PYTHON ?= $(shell for name in python3.11 python3.10 python3; do \
	$$name -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null && { echo $$name; break; }; done)
PIP_FLAGS ?=
# Where to look for PyTorch without CUDA, which is several GB smaller; empty: take what the default index gives.
TORCH_INDEX ?= https://download.pytorch.org/whl/cpu
BIN := .venv/bin
PIP := $(BIN)/python -m pip
SETUP := setup.cfg pyproject.toml constraints.txt

TASK ?= push
METHOD ?= all
SEEDS ?= 6
PROFILE ?= quick

.PHONY: help run test check slow install clean

help: ## list the targets
	@grep -hE '^[a-z]+:.*## ' Makefile | sed -E 's/^([a-z]+):.*## (.*)/  make \1\t\2/' | expand -t 20

run: .venv/installed ## set up, train every method on push in a few minutes, draw the learning curves
	$(BIN)/codesign-bench run --method $(METHOD) --task $(TASK) --seeds $(SEEDS) --profile $(PROFILE)
	$(BIN)/codesign-bench plot

test: .venv/installed-test ## set up, check style and types, run the fast tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q

check: .venv/installed-test ## check style and types alone
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

slow: .venv/installed-test ## run the slow tests: killed sweeps, learning, wheels
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -m slow

install: .venv/installed-test ## set up an environment for development in .venv

clean: ## remove the environment and what tools left behind; results stay
	rm -rf .venv build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

.venv/made:
	@test -n "$(PYTHON)" || { echo "no Python 3.10 or newer found: name one with make PYTHON=..." >&2; exit 1; }
	$(PYTHON) -m venv .venv
	touch $@

# The index may be out of reach behind a mirror; then the default index has to do.
.venv/torch: .venv/made constraints.txt
	@if [ -n "$(TORCH_INDEX)" ] && $(BIN)/python -c \
		'import sys, urllib.request as r; r.urlopen(sys.argv[1], timeout=10)' $(TORCH_INDEX)/torch/ 2>/dev/null; then \
		set -x; $(PIP) install $(PIP_FLAGS) --extra-index-url $(TORCH_INDEX) -c constraints.txt torch; \
	fi
	touch $@

.venv/installed: .venv/torch $(SETUP)
	$(PIP) install $(PIP_FLAGS) -c constraints.txt -e .
	touch $@

.venv/installed-test: .venv/installed
	$(PIP) install $(PIP_FLAGS) -c constraints.txt -e ".[test]"
	touch $@
