.PHONY: help build

help:  ## list the targets
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 10

build:  ## make .venv and build geomsrv into it
	@tools/build
