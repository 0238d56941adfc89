# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters: defaults live once, every limit is enforced by name, and the YAML file repeats them."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import pytest
import yaml

from geomsrv.config import Config, settings
from geomsrv.errors import GeometryError
from geomsrv.queries import TIERS

YAML = Path(__file__).resolve().parents[1] / "config" / "geomsrv.yaml"


def flat(tree: dict, prefix: str = "") -> dict:
    """Nested mappings as dotted names, as ROS reads them."""
    found = {}
    for key, value in tree.items():
        name = f"{prefix}{key}"
        found |= flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return found


def test_yaml_repeats_the_defaults() -> None:
    (node,) = yaml.safe_load(YAML.read_text()).items()
    assert node[0] == "/**"
    given = flat(node[1]["ros__parameters"])
    wanted = {name: list(value) if isinstance(value, tuple) else value for name, value in Config().by_name().items()}
    assert given == wanted
    assert list(given) == list(wanted), "in the order of declaration"
    for name, value in given.items():
        assert type(value) is type(wanted[name]), f"{name}: ROS takes the type from the file"


def test_yaml_explains_every_parameter() -> None:
    text = " ".join(re.sub(r"^\s*#", "", line).strip() for line in YAML.read_text().splitlines())
    for setting in settings():
        assert setting.description in text, setting.name


def test_every_setting_is_described_and_named_like_its_field() -> None:
    names = [setting.name for setting in settings()]
    assert len(set(names)) == len(names) > 20
    for setting, field in zip(settings(), dataclasses.fields(Config), strict=True):
        assert setting.name.replace(".", "_") == field.name
        assert setting.description.endswith(".")
        if isinstance(field.default, float):
            assert setting.minimum is not None, f"{setting.name} has no range"


def test_defaults_are_within_their_limits() -> None:
    config = Config()
    assert Config().changed(config.by_name()) == config
    assert hash(config) == hash(Config())


@pytest.mark.parametrize("setting", settings(), ids=lambda setting: setting.name)
def test_every_limit_is_enforced_by_name(setting) -> None:
    default = Config().by_name()[setting.name]
    bad: list = [None, [1, 2], {}]  # of the wrong type
    if isinstance(default, bool):
        bad += [1, 0.0, "true"]
    elif isinstance(default, float):
        bad += [math.nan, "1", True]
        bad += [setting.minimum - 1e-9] if setting.minimum is not None else []
        bad += [setting.maximum * 1.001, math.inf] if setting.maximum is not None else []
    elif isinstance(default, str):
        bad += [1] if "on" in setting.choices else [1, True]
        bad += ["no such choice"] if setting.choices else []
    else:
        bad = [
            [0.0] * (setting.length - 1),
            [math.nan] * setting.length,
            ["x"] * setting.length,
            [2.0] * setting.length,
        ]
    for value in bad:
        with pytest.raises(GeometryError, match=re.escape(setting.name)):
            Config().changed({setting.name: value})


@pytest.mark.parametrize("setting", [s for s in settings() if s.minimum is not None], ids=lambda s: s.name)
def test_the_ends_of_a_range_belong_to_it(setting) -> None:
    for value in (setting.minimum, setting.maximum):
        if value is None or setting.name.startswith("camera."):
            continue
        assert Config().changed({setting.name: value}).by_name()[setting.name] == value


def test_whole_numbers_are_numbers() -> None:
    assert Config().changed({"max_rate": 50}).max_rate == 50.0
    assert Config().changed({"max_distance": math.inf}).max_distance == math.inf


def test_what_depends_on_each_other() -> None:
    with pytest.raises(GeometryError, match=r"camera\.far must be > camera\.near = 0\.1, got 0\.1"):
        Config().changed({"camera.far": 0.1})
    with pytest.raises(GeometryError, match=r"camera\.pose .*norm 1"):
        Config().changed({"camera.pose": [0, 0, 0, 0, 0, 0, 1.1]})
    with pytest.raises(GeometryError, match="no_such is no parameter"):
        Config().changed({"no_such": 1})
    assert Config().changed({"camera.near": 20.0, "camera.far": 30.0}).camera_near == 20.0


@pytest.mark.parametrize("accuracy", TIERS)
def test_the_tier_is_one_that_every_query_answers(accuracy) -> None:
    assert Config().changed({"accuracy": accuracy}).accuracy == accuracy
