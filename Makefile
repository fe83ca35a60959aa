# `make` lists the targets.  A target that needs the environment builds it first.

PYTEST := .venv/bin/python -m pytest
TIER := not slow
NUMERICAL := $(addprefix tests/, polyhedra skeletons minimisation proofs landscapes branches measures \
    bodies models motion spaces intervals)

.DEFAULT_GOAL := help
.PHONY: help env env-pip dyad paper test wider costs disturbed cores thorough intermediate lint format types imports docs links bench trials constraints clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

# ---------------------------------------------------------------------------------- environments
# One .venv; each stamp says that these extras are in it, as pyproject.toml and constraints.txt ask.

env: .venv/.dev ## everything for development, in .venv

.venv/.runtime: pyproject.toml constraints.txt .ci/env
	@.ci/env
	@touch $@

.venv/.dev: pyproject.toml constraints.txt .ci/env
	@.ci/env dev
	@touch .venv/.runtime $@

.venv/.bench: pyproject.toml constraints.txt .ci/env
	@.ci/env bench
	@touch .venv/.runtime $@

env-pip: ## the same environment with venv and pip alone, where uv cannot be had
	@POLYCORNER_INSTALLER=pip .ci/env dev
	@touch .venv/.runtime .venv/.dev

# ------------------------------------------------------------------------------------------- use

dyad: .venv/.runtime ## the nested pair of dumbbells in the drum, certified and drawn, in out/dyad
	@.venv/bin/polycorner dyad --length 16 --ball 3 --rod 1.5 --drum 125 --out out/dyad

paper: .venv/.runtime ## every claim of the paper checked, slow ones too; the report in out/paper
	@.venv/bin/polycorner paper --slow --out out/paper

# ----------------------------------------------------------------------------------------- check

# The workers already use every core; threads inside the linear algebra would only compete.
test wider costs disturbed cores thorough: export OPENBLAS_NUM_THREADS = 1
test wider costs disturbed cores thorough: export OMP_NUM_THREADS = 1

test: .venv/.dev ## the cheap tests and doctests of every room, in minutes
	@$(PYTEST) -n auto --dist worksteal -m quick tests polycorner

wider: .venv/.dev ## what `make test` leaves out, without what is slow
	@$(PYTEST) -n auto --dist worksteal -m "not quick and not slow"

costs: .venv/.dev ## all tests, recording what each costs: `make test` runs the quick ones
	@$(PYTEST) -n auto --dist worksteal -q --costs

disturbed: .venv/.dev ## what rests on linear algebra, again with other last bits; TIER=quick in part
	@HYPOTHESIS_PROFILE=brief $(PYTEST) -n auto --dist worksteal -q -m "$(TIER)" --disturbed 1 $(NUMERICAL)

cores: .venv/.dev ## what is not slow with the linear algebra of each processor (x86 only; hours)
	@set -e; for core in Prescott Haswell Zen SkylakeX; do echo "$$core"; \
	    OPENBLAS_CORETYPE=$$core $(PYTEST) -n auto --dist worksteal -q -m "not slow"; done

thorough: .venv/.dev ## all tests, with many more generated inputs
	@HYPOTHESIS_PROFILE=thorough $(PYTEST) -n auto --dist worksteal

intermediate: .venv/.dev ## intermediate code anew, after a change of what is compiled
	@for package in measures.chain minimisation.descent proofs.lists motion.engine motion.hulls motion.sweeping; do \
	    .venv/bin/python -m polycorner.$$package.intermediate || exit; done

lint: .venv/.dev ## ruff: rules and format
	@.venv/bin/ruff check .
	@.venv/bin/ruff format --check .

format: .venv/.dev ## let ruff repair what it can
	@.venv/bin/ruff check --fix .
	@.venv/bin/ruff format .

types: .venv/.dev ## mypy --strict on the package and the checks of the paper
	@.venv/bin/mypy

imports: .venv/.dev ## which folder and which file may import which
	@.venv/bin/lint-imports

docs: .venv/.dev ## the documentation, in docs/_build/html
	@.venv/bin/sphinx-build -W --keep-going -j 2 -b html docs docs/_build/html

links: .venv/.dev ## external links of the documentation (needs the network)
	@.venv/bin/sphinx-build -q -b linkcheck -D plot_gallery=0 docs docs/_build/links

bench: .venv/.bench ## side-by-side runs against other tools
	@set -e; for file in $(wildcard benchmarks/bench_*.py); do \
	    echo "$$file"; .venv/bin/python "$$file"; done

trials: .venv/.dev ## correctness on problems that strangers bring, about an hour
	@set -e; for trial in hock_schittkowski random_formulas adversarial known_lists landscapes; do \
	    .venv/bin/python -m benchmarks.trials.run_$$trial; done

# ---------------------------------------------------------------------------------------- upkeep

constraints: .venv/.dev ## resolve the exact versions anew
	@.ci/env --resolve

clean: ## remove what was built, environments included
	rm -rf .venv .uv build dist out docs/_build docs/generated
	rm -rf .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
