# Two commands for people: `make run` opens the viewer on the demo photo, `make test` checks everything.
# Both set up what they need: the environment in .venv, and system GL libraries where that is allowed.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: run test bench fuzz install clean

run: install
	@.ci/system-libraries run
	$(BIN)/iibr demo

test: install
	@.ci/system-libraries test
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/pytest -n 2 --dist loadfile

# DATA: a folder of scenes as `iibr evaluate` takes them; without it, a made-up scene and the demo photo. OUT: for the report.
OUT ?= out/bench
bench: install
	@.ci/system-libraries test
	@mkdir -p "$(OUT)"
	$(BIN)/python -m benchmarks.speed --out "$(OUT)" $(if $(DATA),--data "$(DATA)")

fuzz: install
	@.ci/system-libraries test
	$(BIN)/python -m benchmarks.fuzz

install: $(READY)

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "iibr needs Python 3.11 or later; name one with: make PYTHON=python3.11 ..."; exit 1; }
	$(PYTHON) -m venv $(VENV)
	HATCH_BUILD_NO_HOOKS=true $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	$(BIN)/python -P -m viewer.precompile iibr_core/_kernels
	@touch $(READY)

clean:
	rm -rf $(VENV) out iibr_core/_kernels
