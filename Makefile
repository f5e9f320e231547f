# A fresh machine needs Python 3.11 or newer and make; everything else goes into $(VENV).
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.installed
WARM := $(VENV)/.warmed-up
DOCS := $(VENV)/.installed-docs

# Modules are compiled once, whatever the environment says: the tests start hundreds of processes.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test lint web docs

demo: $(WARM)
	$(BIN)/pneumorph design examples/linear.toml --out runs/linear --resume
	@echo "The pictures are in runs/linear:"
	@find runs/linear -name '*.png' | sort

# Three processes of one thread each, for two cores: some tests wait for browsers and for other processes.
test: $(WARM)
	OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 $(BIN)/python -m pytest -n 3 --dist worksteal --durations=10

lint: $(READY)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright --pythonpath $(BIN)/python

# The page's part in JavaScript: its tests, and whether the page in the package is what it builds.
web:
	@if command -v npm >/dev/null; then \
		cd web && npm install --no-audit --no-fund && npm test && npm run check; \
	else \
		echo "web: skipped, there is no Node.js here (npm)"; \
	fi

# The site, in build/site; warnings are errors, as mkdocs.yml says. It is to be opened from disk:
# build/site/index.html. The variable leaves out a note about other programs, which is not a warning.
docs: $(DOCS)
	NO_MKDOCS_2_WARNING=1 PATH="$(abspath $(BIN)):$$PATH" $(BIN)/python -m mkdocs build
	@du -sh build/site

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -c constraints.txt -e '.[all,dev]'
	touch $@

# What designs need is compiled once, as the last part of the installation.
$(WARM): $(READY)
	$(BIN)/pneumorph warm-up
	touch $@

$(DOCS): $(READY)
	$(BIN)/python -m pip install -c constraints.txt -e '.[docs]'
	touch $@
