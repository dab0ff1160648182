# `make demo` and `make test`: each does all its own set-up in .venv. For people without make: README.md, "Without make".
PYTHON ?= $(shell command -v python3.11 || command -v python3.12 || command -v python3)
BIN := .venv/bin
LOCK := -c constraints.txt
# What `make test` installs: `make test EXTRAS=dev,lab,models` adds PsychoPy and torch, and with them the
# tests of the real window and of training.
EXTRAS ?= dev
ROOMS := protocols devices studies analysis modeling
KERNEL := setup.py $(wildcard devices/models/native/*.[ch])
SOURCES := pyproject.toml setup.py palpate.py $(shell find $(ROOMS) participants_template -type f -not -path '*/__pycache__/*')

.PHONY: demo test check clean

demo: .venv/.demo
	$(BIN)/palpate demo --lab demo-lab

test: .venv/.$(EXTRAS) check
	$(BIN)/coverage erase
	$(BIN)/python -m pytest -n 2 --dist worksteal --cov --cov-report=
	$(BIN)/coverage report --include='protocols/*' --fail-under=95
	$(BIN)/coverage report --include='studies/*' --fail-under=90

check: .venv/.$(EXTRAS)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

.venv/bin/python:
	$(PYTHON) -m venv .venv

.venv/.demo: .venv/bin/python $(SOURCES) constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check $(LOCK) .
	rm -rf build .venv/.dev*
	touch $@

.venv/.$(EXTRAS): .venv/bin/python pyproject.toml constraints.txt $(KERNEL)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check $(LOCK) -e '.[$(EXTRAS)]'
	rm -rf build .venv/.demo
	touch $@

clean:
	rm -rf .venv build demo-lab bench .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage .coverage.*
