# Two commands on a fresh machine: `make run` and `make test`. Each sets up what it needs in .venv first.
# Only Python 3.10 to 3.13, pip and make are assumed. Every recipe runs in this folder, whatever its path.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help

# What is set in the caller's shell must not leak into the environment made here.
unexport VIRTUAL_ENV PYTHONPATH PYTHONHOME

PYTHON ?= $(shell for name in python3.11 python3.10 python3.12 python3.13 python3; do \
	$$name -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null && { echo $$name; break; }; done)
# The oldest and the newest Python here; the 3D tasks of the newest use another build of the physics engine.
OLDEST ?= $(shell for name in python3.10 python3.11 python3.12; do \
	$$name -c '' 2>/dev/null && { echo $$name; break; }; done)
NEWEST ?= $(shell for name in python3.13 python3.12 python3; do \
	$$name -c '' 2>/dev/null && { echo $$name; break; }; done)
PIP_FLAGS ?=
# Where to look for PyTorch without CUDA, which is several GB smaller; empty: take what the default index gives.
TORCH_INDEX ?= https://download.pytorch.org/whl/cpu
BIN := .venv/bin
PIP := $(BIN)/python -m pip
SETUP := setup.cfg pyproject.toml constraints.txt

# Processes that run the fast tests; the tests of a file stay together, for they share what is made once for a file.
WORKERS ?= 2
FAST_TESTS := -m pytest -q -n $(WORKERS) --dist loadfile --no-loadscope-reorder
# What test-oldest and test-newest run, for example TESTS=tests/stats; empty: all fast tests.
TESTS ?=
NUMERIC_TESTS := OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -p no:cacheprovider -m "numeric and not slow"

TASK ?= push
METHOD ?= all
SEEDS ?= 6
PROFILE ?= quick
REFERENCE := results/reference
SECOND := results/second_machine
SUBMISSION := results/submissions/codesign-bench.zip

# How the numerical libraries are made to compute as on processors without newer instructions. In turn: torch's own
# kernels, MKL's and oneDNN's products in torch, OpenBLAS's in numpy, numpy's own kernels (named one way up to numpy 2.3
# and another way since), and the C library's functions. A library ignores what it does not know.
WITHOUT_AVX512 := ATEN_CPU_CAPABILITY=avx2 MKL_ENABLE_INSTRUCTIONS=AVX2 ONEDNN_MAX_CPU_ISA=AVX2 \
	OPENBLAS_CORETYPE=Haswell NPY_DISABLE_CPU_FEATURES=X86_V4,AVX512F,AVX512_SKX,AVX512_ICL,AVX512_SPR
WITHOUT_AVX := ATEN_CPU_CAPABILITY=default MKL_CBWR=COMPATIBLE ONEDNN_MAX_CPU_ISA=SSE41 OPENBLAS_CORETYPE=Nehalem \
	NPY_DISABLE_CPU_FEATURES=X86_V3,AVX2,FMA3,X86_V4,AVX512F,AVX512_SKX,AVX512_ICL,AVX512_SPR \
	GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA

# Installs PyTorch without CUDA by the Python $(1), with the constraints $(2). The index may be out of reach behind a
# mirror; then the default index has to do, later.
define install_torch
@if [ -n "$(TORCH_INDEX)" ] && $(1) -c \
	'import sys, urllib.request as r; r.urlopen(sys.argv[1], timeout=10)' $(TORCH_INDEX)/torch/ 2>/dev/null; then \
	set -x; $(1) -m pip install $(PIP_FLAGS) --extra-index-url $(TORCH_INDEX) $(2) torch; \
fi
endef

.PHONY: help run test renew test-oldest test-newest test-environments test-portable without-avx512 without-avx check slow docs docs-links package install clean

help: ## list the targets
	@grep -hE '^[a-z-]+:.*## ' Makefile | sed -E 's/^([a-z-]+):.*## (.*)/  make \1\t\2/' | expand -t 22

run: .venv/installed ## set up, train every method on push in a few minutes, draw the learning curves
	$(BIN)/codesign-bench run --method $(METHOD) --task $(TASK) --seeds $(SEEDS) --profile $(PROFILE)
	$(BIN)/codesign-bench plot

test: .venv/installed-test ## set up, check style and types, run the fast tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	OMP_NUM_THREADS=1 $(BIN)/python $(FAST_TESTS)

# Cells are added by results/ship_cells.py. What is measured or drawn from cells follows them; nothing is trained.
renew: .venv/installed ## after cells were added to the reference results: best episodes, verdicts, figures, archive, tables
	$(BIN)/codesign-bench headroom --update --candidates 0 --results $(REFERENCE)
	$(BIN)/codesign-bench verify --measure --results $(REFERENCE) --out $(REFERENCE)/claims
	$(BIN)/codesign-bench plot --results $(REFERENCE) --out $(REFERENCE)/figures
	$(BIN)/codesign-bench plot generalization --results $(REFERENCE) --out $(REFERENCE)/figures  # by name: plays around the region
	$(BIN)/codesign-bench verify --results $(SECOND) --compare $(REFERENCE) --out $(SECOND)/agreement
	rm -f $(SUBMISSION)
	$(BIN)/codesign-bench pack $(REFERENCE) --brief --out $(SUBMISSION) --title "reference results" \
		--by "the codesign-bench authors" --tuning "mostly with gnn_ppo; steps per method in results/TUNING.md" \
		--note "joint credit for the design; policies are in results/reference"
	$(BIN)/python results/fill_tables.py

test-oldest: .venv-oldest/installed ## run the fast tests with the oldest packages that setup.cfg allows (a part: TESTS=tests/stats)
	OMP_NUM_THREADS=1 .venv-oldest/bin/python $(FAST_TESTS) $(TESTS)

test-newest: .venv-newest/installed ## run the fast tests with the newest packages, on the newest Python
	OMP_NUM_THREADS=1 .venv-newest/bin/python $(FAST_TESTS) $(TESTS)

.venv-oldest/installed: $(SETUP) tests/oldest_constraints.py
	@test -n "$(OLDEST)" || { echo "no Python 3.10 to 3.12 found: name one with make OLDEST=..." >&2; exit 1; }
	$(OLDEST) -m venv .venv-oldest
	.venv-oldest/bin/python tests/oldest_constraints.py > .venv-oldest/constraints.txt
	$(call install_torch,.venv-oldest/bin/python,-c .venv-oldest/constraints.txt)
	.venv-oldest/bin/python -m pip install $(PIP_FLAGS) -c .venv-oldest/constraints.txt -e ".[test]"
	touch $@

.venv-newest/installed: $(SETUP)
	$(NEWEST) -m venv .venv-newest
	$(call install_torch,.venv-newest/bin/python,)
	.venv-newest/bin/python -m pip install $(PIP_FLAGS) --upgrade --upgrade-strategy eager -e ".[sb3,test,torchrl]"
	touch $@

test-portable: .venv/installed-test ## run the tests that compare numbers under other instruction sets
	$(MAKE) --no-print-directory -j2 --output-sync=target without-avx512 without-avx

test-environments: .venv-environments/installed ## install the environments alone on the newest Python; compare their trajectories
	OMP_NUM_THREADS=1 .venv-environments/bin/python -m pytest -q --noconftest -p no:cacheprovider \
		tests/tasks/test_frozen_scenes.py

.venv-environments/installed: requirements-envs.txt $(SETUP)
	$(NEWEST) -m venv .venv-environments
	.venv-environments/bin/python -m pip install $(PIP_FLAGS) -c constraints.txt -r requirements-envs.txt pytest
	.venv-environments/bin/python -m pip install $(PIP_FLAGS) --no-deps -e .
	touch $@

without-avx512: .venv/installed-test
	$(WITHOUT_AVX512) $(NUMERIC_TESTS)

without-avx: .venv/installed-test
	$(WITHOUT_AVX) $(NUMERIC_TESTS)

check: .venv/installed-test ## check style and types alone
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

slow: .venv/installed-test ## run the slow tests: killed sweeps, learning, wheels
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -m slow

docs: .venv/installed-docs ## build the documentation site in build/site; warnings and broken links are errors
	OMP_NUM_THREADS=1 $(BIN)/python docs/site/make_site.py

docs-links: .venv/installed-docs ## ask for every external link of the site; needs a network
	$(BIN)/python docs/site/make_site.py --links

package: ## build the wheels of program and reference results, install them in a new environment, run it
	PYTHON=$(PYTHON) TORCH_INDEX=$(TORCH_INDEX) .ci/package

install: .venv/installed-test ## set up an environment for development in .venv

clean: ## remove the environment and what tools left behind; results stay
	rm -rf .venv .venv-oldest .venv-newest .venv-environments build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache
	rm -rf reference_package/build reference_package/*.egg-info reference_package/codesign_bench_reference/reference
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

.venv/made:
	@test -n "$(PYTHON)" || { echo "no Python 3.10 or newer found: name one with make PYTHON=..." >&2; exit 1; }
	$(PYTHON) -m venv .venv
	touch $@

.venv/torch: .venv/made constraints.txt
	$(call install_torch,$(BIN)/python,-c constraints.txt)
	touch $@

.venv/installed: .venv/torch $(SETUP)
	$(PIP) install $(PIP_FLAGS) -c constraints.txt -e .
	touch $@

.venv/installed-test: .venv/installed
	$(PIP) install $(PIP_FLAGS) -c constraints.txt -e ".[sb3,test,torchrl]"
	touch $@

.venv/installed-docs: .venv/installed
	$(PIP) install $(PIP_FLAGS) -c constraints.txt -e ".[docs]"
	touch $@
