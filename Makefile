# `make help` lists the targets. Everything runs in .venv, which `make build` makes and keeps up to date.
BIN := .venv/bin
CPP := $(wildcard src/*/*.cpp)
HPP := $(wildcard src/*/*.hpp)

# The ROS wheels set this once they have found their libraries; inherited from another environment it
# would keep them from finding those of .venv.
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE

.PHONY: help build test soak hard demo bench price lint format colcon clean

help:  ## list the targets
	@sed -n 's/^\([a-z]*\):[^#]*## /\1\t/p' Makefile | expand -t 10

build:  ## make .venv and build geomsrv into it
	@tools/build

test: build  ## run the tests on the installed package; ARGS="-k cull" selects some
	$(BIN)/pytest $(ARGS)

soak: build  ## run all tests, the long ones too, with larger random counts
	GEOMSRV_SOAK=1 $(BIN)/pytest -m "soak or not soak" --timeout 7200 $(ARGS)

hard: build  ## judge the hard cases of every class by exact arithmetic; writes docs/hard_cases.md
	PYTHONPATH=test $(BIN)/python -P -m hard $(ARGS)

demo: build  ## a real robot, a node and a client; writes a picture
	$(BIN)/geomsrv demo $(ARGS)

bench: build  ## time the queries against numpy and python-fcl
	$(BIN)/python bench/run.py $(ARGS)

price: build  ## what accuracy costs here; tables, figures and a page in price_output
	$(BIN)/geomsrv price $(ARGS)

lint: build  ## check format, names and types
	$(BIN)/clang-format --dry-run -Werror $(CPP) $(HPP)
	printf '%s\n' $(CPP) | xargs -P 2 -n 1 $(BIN)/clang-tidy -p build --quiet
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format:  ## rewrite the sources in the settled format
	$(BIN)/clang-format -i $(CPP) $(HPP)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

colcon: build  ## colcon build and colcon test in a scratch workspace
	tools/colcon

clean:  ## remove everything that make has made
	rm -rf .venv build demo_output price_output
