# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The examples in the docstrings of the installed package do what they say."""

import doctest
import importlib
import pkgutil

import pytest

import geomsrv


def modules():
    """Names of the modules that people wrote: all but the generated messages."""
    for info in pkgutil.walk_packages(geomsrv.__path__, "geomsrv."):
        if not info.name.startswith(("geomsrv.msg", "geomsrv.srv")) and not info.name.endswith("__main__"):
            yield info.name


@pytest.mark.parametrize("name", ["geomsrv", *sorted(modules())])
def test_examples(name):
    module = importlib.import_module(name)
    result = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    assert result.failed == 0
