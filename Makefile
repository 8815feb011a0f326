# Everything runs inside .venv in this folder; nothing is installed elsewhere.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
# Two workers, a file at a time, in the order of tests/conftest.py: long files first, so that both end together.
PYTEST := $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder
# Bytecode is kept: workers and the many processes that tests start compile nothing again.
unexport PYTHONDONTWRITEBYTECODE
READY_FOR_DOCS := $(VENV)/.ready-for-docs

.PHONY: demo test fast lint docs clean

demo: $(READY)
	$(BIN)/drinksim demo --out demo

test: lint
	$(PYTEST)

fast: $(READY)
	$(PYTEST) -m "not slow"

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The site; warnings are errors, and no page fetches anything from elsewhere.
docs: $(READY_FOR_DOCS)
	$(BIN)/sphinx-build --quiet --fail-on-warning --keep-going -j auto -d build/doctrees docs site
	! grep -rlE '<(script|link|img|iframe)[^>]* (src|href)="(https?:)?//' site --include='*.html'

$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[test]"
	touch $(READY)

$(READY_FOR_DOCS): $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[docs]"
	touch $(READY_FOR_DOCS)

clean:
	rm -rf $(VENV) demo build site docs/reference/api/generated *.egg-info
