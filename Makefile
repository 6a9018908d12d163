# `make demo` and `make test` set up everything they need in .venv, from nothing.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
OUT    ?= demo
STUDY  := $(OUT)/eclipse
TESTED := study,cluster,compare,logs,ulog,dev
PIP    := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
CORE   := $(wildcard core/*.* core/*/*.[ch] aircraft/*/*.[ch])

# Where there is no C compiler, one from the package index builds what comes without a wheel.
ifeq ($(origin CC)$(shell command -v cc || command -v gcc || command -v clang),default)
ZIG := $(CURDIR)/$(BIN)/python -m ziglang cc
endif

# Modules are compiled when they are first imported (most never are), and kept.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test test-slow test-browser test-packaging bench docs lint clean

# The isolation-time study of the Eclipse, both banks, then a check of every alarm's proof.
demo: $(VENV)/.study $(VENV)/.library
	rm -rf $(STUDY)
	$(BIN)/svo study eclipse --runs 2 --seed 0 --noise quiet --models nonlinear --models lpv --out $(STUDY)
	$(BIN)/svo verify $(STUDY)/alarms.jsonl.gz
	@echo "Open $(STUDY)/report.html in a browser; everything else is beside it."

# Two processes on two cores: a matrix product that took both would hold up the other process.
test: export OPENBLAS_NUM_THREADS := 1
test: $(VENV)/.dev $(VENV)/.library
	@$(MAKE) --no-print-directory -j2 lint $(VENV)/.compiled
	$(BIN)/python -m pytest -n 2 --dist worksteal

# The long checks, an hour of CPU in named groups (make test-slow GROUPS="soundness polytopes"); a stopped run goes on.
test-slow: $(VENV)/.dev $(VENV)/.library
	$(BIN)/python -m tests.slow $(GROUPS)

# The report of a study in headless Chromium or Chrome; skipped, with the reason, where there is none.
test-browser: $(VENV)/.dev $(VENV)/.library
	$(BIN)/python -m pytest -m browser -rs

# Wheel and source archive: built, installed into an empty environment, used from outside this folder.
test-packaging: $(VENV)/.dev $(VENV)/.library
	$(BIN)/python -m pytest -m packaging -rs

bench: $(VENV)/.dev $(VENV)/.library
	$(BIN)/python -m benchmarks

# The documentation site, offline; a broken link or reference is an error.
docs: $(VENV)/.docs $(VENV)/.library
	$(BIN)/python -m sphinx -q -W --keep-going -aE -b html docs docs/_build/html
	@echo "Open docs/_build/html/index.html in a browser."

lint: $(VENV)/.dev $(VENV)/.library
	$(BIN)/ruff check .
	$(BIN)/mypy

clean:
	rm -rf $(VENV) $(STUDY) docs/_build docs/_copied build *.egg-info polytopes/_core.*
	-git clean -qXfd core

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python 3.11 or later is needed; name one: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	$(PYTHON) -m venv $(VENV)

# The core is built by each installation, and again when a file of it was edited.
$(VENV)/.library: $(CORE) | $(BIN)/python
	$(PIP) --no-deps --editable .
	@touch $@

$(VENV)/.study: pyproject.toml | $(BIN)/python
	@echo "Installing what the study needs into $(VENV) (about a minute)"
	$(PIP) --editable '.[study]'
	@touch $@ $(VENV)/.library

$(VENV)/.dev: pyproject.toml | $(BIN)/python
	@echo "Installing what the tests need into $(VENV) (about a minute)"
	@$(if $(ZIG),$(PIP) ziglang)
	$(if $(ZIG),CC="$(ZIG)") $(PIP) --editable '.[$(TESTED),cdd]' || { $(PIP) --editable '.[$(TESTED)]' && \
	  echo "No pycddlib for this machine: its tests will be skipped"; }
	@touch $@ $(VENV)/.study $(VENV)/.library

# After an installation, while one core checks types, the other imports all tests: both processes find them compiled.
$(VENV)/.compiled: $(VENV)/.dev
	@$(BIN)/python -m pytest --collect-only -qq >/dev/null || true  # what fails here fails in the tests, too
	@touch $@

$(VENV)/.docs: pyproject.toml | $(BIN)/python
	@echo "Installing what the documentation needs into $(VENV) (about a minute)"
	$(PIP) --editable '.[study,docs]'
	@touch $@ $(VENV)/.library
