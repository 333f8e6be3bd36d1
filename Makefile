# make demo   environment, install, the main job on an embedded example, a report to open
# make test   environment, install, all tests
# make test-fast   the same less the tests that are marked slow
# make docs   the documentation as a site to open without a network: docs/_build/html/index.html
# make bench  beside what a user would pick instead, on the same work: docs/benchmarks.md (20 minutes)
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed

.PHONY: install demo test test-fast lint docs bench clean

install: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(not ((3, 11) <= sys.version_info < (3, 14)) and "dynident needs Python 3.11 to 3.13: make PYTHON=/path/to/it")'
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test]'
	touch $@

demo: install
	$(BIN)/dynident demo

# One worker a processor: threads of the linear algebra beside them would wait for each other.
# Work is stolen by the half, so that a file mostly stays with one worker and what its tests share is
# made once. Where a worker dies its test has failed and the rest goes on; `loadfile` would hang.
test test-fast: export OMP_NUM_THREADS = 1
# Where an environment forbids bytecode, every worker and every process that a test begins would
# compile the package and the tests anew.
test test-fast: export PYTHONDONTWRITEBYTECODE =

test: install
	$(BIN)/python -m pytest -n logical --maxprocesses 4 --dist worksteal --durations=40 --durations-min=5

test-fast: install
	$(BIN)/python -m pytest -n logical --maxprocesses 4 --dist worksteal -m "not slow"

lint: install
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[lint]'
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright --pythonpath $(BIN)/python

docs: install
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo docs/_build/html/index.html

# Peers get environments of their own in .bench; who cannot be installed is a line with the reason.
bench: export OMP_NUM_THREADS = 1

bench: install
	$(BIN)/python benchmarks/run.py

clean:
	rm -rf .venv .bench docs/_build docs/_made
