# make study   a first look: installs into .venv and computes the paper's preload study
# make test    everything that CI checks
# make docs    regenerates what the documentation shows of the program's output
# make bench   measures how effort grows with the number of elements: docs/benchmarks.md
# make extremes   ten thousand random scenes against independent references: the errors stated are true
#                 (SCENES=500 for fewer)

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
STUDIES := $(wildcard results/*.csv)
SCENES ?= 10000

.PHONY: study test tables docs bench extremes clean

study: $(VENV)/.study
	$(BIN)/cablestudy sweep configs/preload.yaml

test: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pytest -q
	$(MAKE) tables

# every stored table, computed anew and compared
tables: $(VENV)/.study
	@for table in $(STUDIES); do \
	    $(BIN)/cablestudy sweep configs/$$(basename $$table .csv).yaml --check || exit 1; \
	done

docs: $(VENV)/.test
	$(BIN)/python docs/refresh.py

bench: $(VENV)/.study
	$(BIN)/python benchmarks/scaling.py > docs/benchmarks.new
	mv docs/benchmarks.new docs/benchmarks.md

extremes: $(VENV)/.test
	$(BIN)/python benchmarks/extremes.py --scenes $(SCENES)

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.study: $(VENV)/bin/python pyproject.toml constraints.txt
	$(INSTALL) --editable .
	touch $@

$(VENV)/.test: $(VENV)/.study
	$(INSTALL) --editable ".[test]"
	touch $@

clean:
	rm -rf $(VENV)
