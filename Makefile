# `make demo` and `make test` set up everything they need in .venv, from nothing.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
OUT    ?= demo
STAMP  := $(VENV)/.installed

.PHONY: demo test test-slow bench lint clean

demo: $(STAMP)
	$(BIN)/svo study eclipse --runs 10 --seed 0 --workers 2 --noise quiet --out $(OUT)/quiet
	$(BIN)/svo study eclipse --runs 10 --seed 0 --workers 2 --noise conservative --out $(OUT)/conservative
	$(BIN)/svo verify $(OUT)/quiet/alarms.jsonl
	$(BIN)/svo verify $(OUT)/conservative/alarms.jsonl

test: lint
	$(BIN)/python -m pytest -n 2

test-slow: $(STAMP)
	$(BIN)/python -m pytest -n 2 -m slow

bench: $(STAMP)
	$(BIN)/python -m benchmarks

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/mypy

clean:
	rm -rf $(VENV) $(OUT) build *.egg-info

$(STAMP): pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[study,dev]'
	touch $(STAMP)
