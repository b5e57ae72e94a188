# Two commands for people: `make run` opens the viewer on the demo photo, `make test` checks everything.
# Both set up what they need, and no more: the environment in .venv, and system GL libraries where that is allowed.

PYTHON ?= python3
PYTHONS ?= python3.11 python3.12 python3.13
VENV := .venv
BIN := $(VENV)/bin
PIP := HATCH_BUILD_NO_HOOKS=true $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
READY := $(VENV)/.ready
READY_TESTS := $(VENV)/.ready-tests
KERNELS := $(VENV)/.kernels
HEADSET := tests/web/node_modules

.PHONY: run test test-bundle bench figures fuzz site licences install kernels dist bundle deb rpm clean

run: $(READY)
	@.ci/system-libraries run
	@mkdir -p out && cd out && ../$(BIN)/iibr demo

test: install kernels
	@.ci/system-libraries test
	@$(MAKE) --no-print-directory $(HEADSET)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder --max-worker-restart 0

# Installs the packages in Debian 12 and 13 and Ubuntu 22.04 and 24.04 without Python, and uses them there: as root, in some
# minutes. ARGS: more words for pytest. What is downloaded is kept in out/chroots.
test-bundle: install deb rpm
	@.ci/system-libraries test
	@.ci/system-libraries test-bundle
	$(BIN)/pytest tests/bundle $(ARGS)

# Compares our views with a plain warp's. DATA: a folder of scenes as `iibr evaluate` takes them; without it, drawn scenes.
# ARGS: more words, see `python -m benchmarks compare --help`.
bench: install
	@.ci/system-libraries test
	$(BIN)/python -m benchmarks compare $(if $(DATA),--data "$(DATA)") $(ARGS)

# Makes every table and picture of README and docs/ again. DATA: as above. MODEL: a depth network as an ONNX file.
# ONLY: names, by commas. ARGS: --list shows the tables and what they need; --check those older than the code.
figures: install
	@.ci/system-libraries test
	$(BIN)/python -m benchmarks tables $(if $(DATA),--data "$(DATA)") $(if $(MODEL),--model "$(MODEL)") \
		$(if $(ONLY),--only "$(ONLY)") $(ARGS)

fuzz: install
	@.ci/system-libraries test
	$(BIN)/python -m benchmarks fuzz

# The pages of docs/ as a web site; warnings, broken links among them, are errors.
site: $(READY)
	$(PIP) -e '.[docs]'
	$(BIN)/python -P -m sphinx -q -W --keep-going -n -b html -d out/site-trees docs out/site
	@echo "out/site/index.html"

# docs/licences.md: the licences of all libraries of an installation.
licences: install
	$(BIN)/python -P packaging/licences.py --output docs/licences.md

install: $(READY_TESTS)

# All is compiled to bytecode here, by all cores: pip takes one, and a start keeps none where PYTHONDONTWRITEBYTECODE is set.
$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "iibr needs Python 3.11 or later; name one with: make PYTHON=python3.11 ..."; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(PIP) --no-compile -e .
	@$(BIN)/python -m compileall -qq -j 0 $(VENV)/lib iibr_core viewer || true
	@touch $(READY)

$(READY_TESTS): $(READY)
	@.ci/cpu-torch $(BIN)/python
	$(PIP) -e '.[dev]'
	@touch $(READY_TESTS)

# The headset that tests of web pages wear: a package of npm, by the hashes in package-lock.json.
$(HEADSET): tests/web/package-lock.json
	npm ci --silent --ignore-scripts --prefix tests/web
	@touch $@

# Compiles all kernels of the present sources, in a minute or two; what is missing is compiled where it is first used.
kernels: $(KERNELS)

$(KERNELS): $(READY) $(shell find iibr_core viewer -name '*.py')
	$(BIN)/python -P -m viewer.precompile iibr_core/_kernels
	@touch $@

# dist/: the source package, and from it a wheel without kernels, for all systems, and a wheel with kernels for each of PYTHONS.
dist: install
	rm -f dist/iibr-*.whl dist/iibr-*.tar.gz
	$(BIN)/python -m hatchling build -t sdist -d dist
	HATCH_BUILD_NO_HOOKS=true $(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist dist/iibr-*.tar.gz
	@for python in $(PYTHONS); do \
		if $$python --version >/dev/null 2>&1; then \
			echo "compiling kernels for $$python, some minutes"; \
			$(BIN)/python -m pip --python "$$(command -v $$python)" wheel --quiet --no-deps --wheel-dir dist dist/iibr-*.tar.gz || exit 1; \
		else \
			echo "no $$python here: no wheel with kernels for it"; \
		fi; \
	done
	$(BIN)/python -m twine check --strict dist/iibr-*.whl dist/iibr-*.tar.gz

# out/bundle/iibr: the program with its Python, for computers without one. PyInstaller needs a Python with a shared
# library, as Debian 12's, which asks for glibc 2.35; the wheels ask for 2.28, so a Python built for that takes the bundle
# to older systems: packaging/linux/nfpm.yaml states it. Kernels are compiled again when a source of the core is newer.
BUNDLE_PYTHON ?= /usr/bin/python3
BUNDLE_BIN := out/bundle-venv/bin
BUNDLE_PIP := HATCH_BUILD_NO_HOOKS=true $(BUNDLE_BIN)/python -m pip install --quiet --disable-pip-version-check

bundle: out/bundle/.ready

$(BUNDLE_BIN)/.ready: pyproject.toml constraints.txt
	@.ci/system-libraries bundle
	$(BUNDLE_PYTHON) -m venv --clear out/bundle-venv
	$(BUNDLE_PIP) -c constraints.txt '.[bundle]'
	@touch $@

$(BUNDLE_BIN)/.kernels: $(BUNDLE_BIN)/.ready $(shell find iibr_core viewer/precompile.py -name '*.py')
	$(BUNDLE_PIP) --no-deps --force-reinstall .
	$(BUNDLE_BIN)/python -P -m viewer.precompile \
		"$$($(BUNDLE_BIN)/python -P -c 'import iibr_core; print(iibr_core.__path__[0])')/_kernels"
	@touch $@

out/bundle/.ready: $(BUNDLE_BIN)/.kernels packaging/iibr.spec $(shell find viewer shaders assets web -type f -not -name '*.pyc')
	$(BUNDLE_PIP) --no-deps --force-reinstall .
	$(BUNDLE_BIN)/python -P -m PyInstaller --log-level WARN --noconfirm --distpath out/bundle --workpath out/bundle-work \
		packaging/iibr.spec
	@touch $@

# dist/iibr_*.deb and dist/iibr-*.rpm: the bundle as a package. xz in place of nfpm's compressors saves a fifth.
PACK = VERSION=$$($(BUNDLE_BIN)/python -P -c 'from importlib.metadata import version; print(version("iibr"))') \
	$(BUNDLE_BIN)/nfpm package --config packaging/linux/nfpm.yaml --packager $@ --target

rpm: out/pages/.ready
	@mkdir -p dist
	$(PACK) dist/

deb: out/pages/.ready
	@rm -rf out/deb && mkdir -p out/deb dist
	$(PACK) out/deb/
	cd out/deb && ar x iibr_*.deb data.tar && xz -6 -T2 data.tar && ar d iibr_*.deb data.tar && ar q iibr_*.deb data.tar.xz
	mv out/deb/iibr_*.deb dist/

out/pages/.ready: out/bundle/.ready packaging/licences.py packaging/native-libraries.csv $(wildcard packaging/linux/*) CHANGELOG.md
	$(BUNDLE_BIN)/python -P packaging/linux/pages.py out/pages
	$(BUNDLE_BIN)/python -P packaging/licences.py --texts out/pages/copyright
	@touch $@

clean:
	rm -rf $(VENV) $(HEADSET) out dist iibr_core/_kernels
