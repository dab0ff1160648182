# `make demo` and `make test`: each does all its own set-up in .venv. For people without make: README.md, "Without make".
PYTHON ?= $(shell command -v python3.11 || command -v python3.12 || command -v python3)
BIN := .venv/bin
# What `make test` installs. `make test EXTRAS=test,models` adds torch, and with it the tests that need it;
# what a run left out, and how to run it, stands in its last lines.
EXTRAS ?= test
ALL := dev,lab,models
ROOMS := protocols signals devices studies analysis modeling
KERNEL := setup.py $(wildcard signals/models/native/*.[ch])
SOURCES := pyproject.toml setup.py $(wildcard palpate/*.py) $(shell find $(ROOMS) participants_template -type f -not -path '*/__pycache__/*')

# Run a command and say how long it took: $(call timed,words,command)
timed = @echo '$(2)'; began=$$(date +%s); $(2) && echo "$(1): $$(($$(date +%s) - began)) s"
CHECKS := $(BIN)/ruff check . && $(BIN)/ruff format --check . && $(BIN)/mypy && $(BIN)/lint-imports
PYTEST := $(BIN)/python -m pytest --dist worksteal --durations=30 --durations-min=3

# A module is compiled when it is first imported, and kept: to compile all of every package takes half of pip's time.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test tests test-all all-tests check clean

demo: .venv/.demo
	$(call timed,demo,$(BIN)/palpate demo --lab demo-lab)

test: check tests

tests: .venv/.$(EXTRAS)
	$(call timed,tests,$(PYTEST) -n 2)

# Everything, with the coverage that two rooms must have; the static checks run beside the tests. Three processes on two cores: tests of a
# window, a browser or a kill wait a third of their time.
test-all: .venv/.$(ALL)
	$(MAKE) -j 2 EXTRAS=$(ALL) check all-tests
	$(BIN)/coverage report --include='protocols/*' --fail-under=95
	$(BIN)/coverage report --include='studies/*' --fail-under=90

all-tests: .venv/.$(ALL)
	$(call timed,tests,$(PYTEST) -n 3 --all --cov --cov-report=)

check: .venv/.$(EXTRAS)
	$(call timed,static checks,$(CHECKS))

.venv/bin/python:
	$(PYTHON) -m venv .venv

.venv/.demo: .venv/bin/python $(SOURCES) constraints.txt
	$(call timed,pip,$(PIP) .)
	rm -rf build && find .venv -maxdepth 1 -type f -name '.*' -delete
	touch $@

.venv/.%: .venv/bin/python pyproject.toml constraints.txt $(KERNEL)
	$(call timed,pip,$(PIP) -e ".[$*]")
	rm -rf build .venv/.demo
	touch $@

clean:
	rm -rf .venv build demo-lab bench .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage .coverage.*
