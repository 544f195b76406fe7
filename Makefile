# make study   a first look: installs into .venv and computes the paper's preload study
# make test    everything that CI checks
# make docs    regenerates what the documentation shows of the program's output
# make bench   measures speed and error, beside other programs where they can be had: docs/benchmarks.md

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
STUDIES := $(wildcard results/*.csv)

.PHONY: study test tables docs bench clean

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

bench: $(VENV)/.bench
	$(BIN)/python benchmarks/run.py > docs/benchmarks.new
	mv docs/benchmarks.new docs/benchmarks.md

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.study: $(VENV)/bin/python pyproject.toml constraints.txt
	$(INSTALL) --editable .
	touch $@

$(VENV)/.test: $(VENV)/.study
	$(INSTALL) --editable ".[test]"
	touch $@

# the other programs are not there for every machine: without them their columns say so
$(VENV)/.bench: $(VENV)/.study
	$(INSTALL) --editable ".[bench]" || $(INSTALL) "mpmath>=1.3"
	touch $@

clean:
	rm -rf $(VENV)
