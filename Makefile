# make study   a first look: installs into .venv and computes the paper's preload study
# make test    everything that CI checks; of campaigns of many scenes a part that has each kind, and what once was wrong
# make campaigns  the files of tests with campaigns, whole: all their scenes and all combinations of parameters
#                 (FILES="tests/test_twins.py ..." for some)
# make docs    regenerates what the documentation shows of the program's output
# make site    builds build/site/index.html: docs/ with a reference generated from the code, all links checked
# make trade   measures error against time: results/trade-*.csv and .md, and their pictures
# make kills   kills a sweep 100 times, resumes it each time, and compares its table
# make attack  gives mutated files and options to every command: no traceback, warning, number that is not finite, or wait
#                 (MUTATIONS=100 for fewer, FIRST=3000 for others)
# make bench   measures speed and error, beside other programs where they can be had: docs/benchmarks.md
# make extremes   ten thousand random scenes and a thousand random suspensions against independent references: the
#                 errors stated are true
#                 (SCENES=500 for fewer; OUT=FILE.jsonl keeps what is done, and goes on from it)
# make lowest  the tests with the oldest versions of the libraries that pyproject.toml allows
# make processors   the numerical tests and the stored tables under every core type of OpenBLAS that this machine can
#                   run: last digits differ, and nothing else may

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
CONSTRAINTS ?= constraints.txt
# python compiles what it imports when it first does: pip would compile thousands of modules that nothing imports
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --constraint $(CONSTRAINTS)
# the trade tables hold times, which no two runs agree on: tests/test_trade.py compares their errors;
# tests/test_docs.py has checked those whose name does not begin with carlina- when `make test` comes to them
STUDIES := $(filter-out results/trade-%,$(wildcard results/*.csv))
# longer than all others together: all processors share its rows
LONGEST := results/carlina-balloon-diameter.csv
DAMPED := cable.damping={model: hysteretic, loss_factor: 0.02}
SCENES ?= 10000
SUSPENSIONS ?= 1000
FIRST ?= 0
MUTATIONS ?= 3000
JOBS ?= 1
FILES ?= $(shell grep -rlE "import campaign$$|pytest.mark.crossed$$" tests --include=test_*.py)
# what solves equations; the other tests are about files, words and pictures
NUMERICAL := tests/properties tests/verification $(filter-out %_command.py %_commands.py %_plots.py %_scene.py, \
    $(wildcard tests/test_suspension_*.py)) $(patsubst %,tests/test_%.py,assembly catenary cable_motion carried_masses \
    dynamics element ends equilibrium extremes gondola initial_length load_cases paper wind_variance windrms \
    row sag_tension segment stability state statespace stiffness)

# where nothing compiled is kept each command compiles the whole program, which takes a third of its start
export PYTHONDONTWRITEBYTECODE =

.PHONY: study test campaigns tables docs site trade kills attack bench extremes lowest lowest-tests processors numerical \
    clean

study: $(VENV)/.study
	$(BIN)/cablestudy sweep configs/preload.yaml --restart

test: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pytest -q -n auto --dist worksteal
	$(MAKE) tables STUDIES="$(LONGEST)" JOBS=$$(getconf _NPROCESSORS_ONLN)
	$(MAKE) tables STUDIES="$(filter-out $(LONGEST),$(filter results/carlina-%,$(STUDIES)))"

campaigns: $(VENV)/.test
	CABLESTUDY_CAMPAIGNS=whole $(BIN)/pytest -q -n auto --dist worksteal $(FILES)

# every stored table, computed anew and compared; as many at once as there are processors, since most are short
tables: $(VENV)/.study
	@for table in $(STUDIES); do \
	    name=$$(basename $$table .csv).yaml; \
	    for study in configs/$$name configs/suspensions/$$name; do \
	        if [ -e $$study ]; then echo $$study; fi; \
	    done; \
	done | xargs -P $$(getconf _NPROCESSORS_ONLN) -I STUDY $(BIN)/cablestudy sweep STUDY --check --jobs $(JOBS)

docs: $(VENV)/.test
	$(BIN)/python docs/refresh.py
	$(BIN)/python docs/notebook_pages.py

site: $(VENV)/.site
	$(BIN)/python docs/build_site.py

# damped strain instead of the paper's modal damping, for which the continuous cable has no response
trade: $(VENV)/.study
	for scene in carlina slack; do \
	    $(BIN)/cablestudy trade configs/$$scene.yaml --set "$(DAMPED)" --out results \
	        --plot docs/pictures/trade-$$scene.svg || exit 1; \
	done
	$(BIN)/cablestudy trade configs/suspensions/fast.yaml --out results --plot docs/pictures/trade-fast.svg

kills: $(VENV)/.study
	$(BIN)/python benchmarks/kills.py 100

attack: $(VENV)/.test
	nice -n 19 $(BIN)/python tests/fuzz.py --first $(FIRST) --count $(MUTATIONS) --keep build/attack

bench: $(VENV)/.bench
	$(BIN)/python benchmarks/run.py > docs/benchmarks.new
	mv docs/benchmarks.new docs/benchmarks.md

extremes: $(VENV)/.test
	$(BIN)/python benchmarks/extremes.py --scenes $(SCENES) $(if $(OUT),--out $(OUT) --resume)
	$(BIN)/python benchmarks/extremes.py --suspensions --scenes $(SUSPENSIONS) \
	    $(if $(OUT),--out $(OUT).suspensions --resume)

# in an environment of its own; old libraries use what newer ones warn of, and pages have pictures of the newest ones
lowest:
	mkdir -p build
	sed -n '/^dependencies/,/^]/ s/.*"\([a-z]*\).*>=\([0-9.]*\)".*/\1==\2/p' pyproject.toml > build/lowest.txt
	$(MAKE) lowest-tests VENV=build/lowest CONSTRAINTS=build/lowest.txt

lowest-tests: $(VENV)/.test
	$(BIN)/pytest -q -n auto --dist worksteal --override-ini filterwarnings=default --ignore tests/test_docs.py

processors: $(VENV)/.test
	@cores=$$($(BIN)/python benchmarks/processors.py) || exit 1; \
	for core in $$cores; do \
	    echo "OPENBLAS_CORETYPE=$$core"; \
	    OPENBLAS_CORETYPE=$$core $(MAKE) --no-print-directory numerical tables || exit 1; \
	done

numerical: $(VENV)/.test
	$(BIN)/pytest -q -n auto --dist worksteal $(NUMERICAL)

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.study: $(VENV)/bin/python pyproject.toml $(CONSTRAINTS)
	$(INSTALL) --editable .
	touch $@

$(VENV)/.test: $(VENV)/.study
	$(INSTALL) --editable ".[test]"
	touch $@

$(VENV)/.site: $(VENV)/.study
	$(INSTALL) --editable ".[site]"
	touch $@

# the other programs are not there for every machine: without them their columns say so
$(VENV)/.bench: $(VENV)/.study
	$(INSTALL) --editable ".[bench]" || $(INSTALL) "mpmath>=1.3"
	touch $@

clean:
	rm -rf $(VENV)
