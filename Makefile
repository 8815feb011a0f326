# Everything runs inside .venv in this folder; nothing is installed elsewhere.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test fast lint clean

demo: $(READY)
	$(BIN)/drinksim demo --out demo

test: lint
	$(BIN)/python -m pytest -n 2 --dist loadfile

fast: $(READY)
	$(BIN)/python -m pytest -m "not slow" -n 2 --dist loadfile

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[test]"
	touch $(READY)

clean:
	rm -rf $(VENV) demo build *.egg-info
