# Two targets do everything on a fresh machine with Python, make and git: `make demo`, `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test check bench wheel clean

demo: $(READY)
	$(BIN)/bunraku demo --video demo.mp4 --report demo.json

# Kernels are compiled once before, not by each worker; bytecode is kept, as tests start many programs.
test: export PYTHONDONTWRITEBYTECODE :=
test: $(READY)
	$(BIN)/bunraku doctor --warm
	$(BIN)/python -m pytest -n auto --dist worksteal

check: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(READY)
	$(BIN)/bunraku bench

wheel: $(READY)
	$(BIN)/python scripts/compiled_wheel.py dist

$(READY): pyproject.toml constraints.txt scripts/system-libraries
	sh scripts/system-libraries
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[dev]"
	$(BIN)/bunraku doctor --warm
	touch $(READY)

clean:
	rm -rf $(VENV) build dist
