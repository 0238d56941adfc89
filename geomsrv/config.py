# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What can be configured: every parameter of the node with its default, range and meaning.

The defaults live here and nowhere else; ``config/geomsrv.yaml`` repeats them for those who want to change some.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, field, fields, replace
from typing import Any

from geomsrv import _validate, effects
from geomsrv.errors import GeometryError
from geomsrv.ladder import AUTO

__all__ = ["Config", "Setting", "settings"]


@dataclass(frozen=True)
class Setting:
    """Meaning and limits of one parameter.

    Attributes
    ----------
    name : str
        As the node calls it, "cross_check.mode".
    description : str
    unit : str
        SI symbol; empty for none.
    minimum, maximum : float or None
        Closed range of a number.
    choices : tuple of str
        What a text may be; empty for any.
    length : int
        Exact number of items of a list; 0 for no list.
    read_only : bool
        Can be set at start only.
    """

    name: str
    description: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    length: int = 0
    read_only: bool = False

    def fault(self, value: Any, default: Any) -> str:
        """What is wrong with `value`; empty if nothing is."""
        kind = type(default)
        if kind is float and type(value) is int:
            value = float(value)
        if self.length:
            numbers = isinstance(value, tuple) and all(isinstance(x, (int, float)) for x in value)
            if not numbers or len(value) != self.length:
                return f"{self.name} must be {self.length} numbers, got {value!r}"
            return "" if all(map(math.isfinite, value)) else f"{self.name} must be finite, got {value!r}"
        if type(value) is not kind:
            return f"{self.name} must be {kind.__name__}, got {value!r}"
        if self.choices and value not in self.choices:
            return f"{self.name} must be one of {', '.join(self.choices)}, got {value!r}"
        # Written so that NaN fails.
        if self.minimum is not None and not value >= self.minimum:
            return f"{self.name} must be >= {self.minimum:g}, got {value}"
        if self.maximum is not None and not value <= self.maximum:
            return f"{self.name} must be <= {self.maximum:g}, got {value}"
        return ""


def _setting(default: Any, name: str, description: str, **limits: Any) -> Any:
    """A dataclass field that carries its `Setting`."""
    return field(default=default, metadata={"setting": Setting(name, description, **limits)})


SWITCH = (effects.AUTO, effects.ON, effects.OFF)


def _switch(effect: str, description: str) -> Any:
    """The parameter of an effect."""
    return _setting(effects.AUTO, f"effects.{effect}", description, choices=SWITCH)


@dataclass(frozen=True)
class Config:
    """Values of all parameters.

    Raises
    ------
    GeometryError
        Names the parameter and the fault.

    Examples
    --------
    >>> from geomsrv.config import Config
    >>> Config().cross_check_mode
    'off'
    >>> Config().changed({"camera.far": 0.05})
    Traceback (most recent call last):
        ...
    geomsrv.errors.GeometryError: camera.far must be > camera.near = 0.1, got 0.05
    """

    autostart: bool = _setting(
        True, "autostart", "Configure and activate at start, without waiting for a lifecycle manager.", read_only=True
    )
    fixed_frame: str = _setting(
        "world", "fixed_frame", "Frame in which the scene is kept and all answers are given.", read_only=True
    )
    accuracy: str = _setting(
        AUTO,
        "accuracy",
        "Tier of the topics, and of service requests that name none; auto: for each item the cheapest that will do.",
        choices=(AUTO, *_validate.ACCURACIES),
    )
    max_rate: float = _setting(
        30.0,
        "max_rate",
        "Most evaluations per second; inputs that come faster are all applied and evaluated together.",
        unit="Hz",
        minimum=0.1,
        maximum=1000.0,
    )
    max_distance: float = _setting(
        0.5, "max_distance", "Pairs further apart are not listed on ~/distances.", unit="m", minimum=0.0
    )
    horizon: float = _setting(
        2.0, "horizon", "How far ahead ~/contacts looks, velocities being constant.", unit="s", minimum=0.0
    )
    idle_rate: float = _setting(
        1.0,
        "idle_rate",
        "How often ~/states is looked at while it says the same and no answer is asked for; requests and new "
        "subscribers look first.",
        unit="Hz",
        minimum=0.1,
        maximum=1000.0,
    )
    states_timeout: float = _setting(
        1.0,
        "states_timeout",
        "Diagnostics warn when a stream of ~/states has stopped for longer.",
        unit="s",
        minimum=0.01,
        maximum=3600.0,
    )
    effects_cull: str = _switch("cull", "Culling: ~/visible and ~/cull.")
    effects_distance: str = _switch("distance", "Distances: ~/distances and ~/distance.")
    effects_witness: str = _switch("witness", "Nearest points and normals of distances.")
    effects_penetration: str = _switch("penetration", "Penetration depths of overlapping bodies.")
    effects_first_contact: str = _switch(
        "first_contact",
        "Looking ahead; without it ~/contacts lists what touches now and ~/first_contact answers NOT_AVAILABLE.",
    )
    effects_rotation: str = _switch(
        "rotation", "Following what turns; without it that is UNSUPPORTED unless it is in contact now."
    )
    effects_contact_set: str = _switch("contact_set", "The points of contact.")
    effects_cross_check: str = _switch(
        "cross_check", "The second opinion by FCL: as cross_check.mode says, or, switched on, of all if that is off."
    )
    effects_markers: str = _switch("markers", "~/markers.")
    contacts_margin: float = _setting(
        0.0,
        "contacts.margin",
        "Pairs on ~/contacts are in contact when they come as near as this; above 0 at accuracy auto and float64 only.",
        unit="m",
        minimum=0.0,
    )
    contacts_earliest: bool = _setting(
        False, "contacts.earliest", "List on ~/contacts only the pair that is first in contact."
    )
    camera_frame: str = _setting(
        "",
        "camera.frame",
        "Optical frame of the camera whose pose camera.pose gives. Empty: camera.pose is not used. A ~/camera_info "
        "in another frame than this and the fixed one needs tf2.",
    )
    camera_pose: tuple[float, ...] = _setting(
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        "camera.pose",
        "Pose of camera.frame (z forward, x right, y down) in the fixed frame: position x y z [m], unit quaternion "
        "x y z w.",
        length=7,
    )
    camera_near: float = _setting(0.1, "camera.near", "Depth at which the view begins.", unit="m", minimum=1e-6)
    camera_far: float = _setting(10.0, "camera.far", "Depth at which the view ends.", unit="m", minimum=1e-6)
    markers_rate: float = _setting(
        5.0, "markers.rate", "Most messages per second on ~/markers.", unit="Hz", minimum=0.1, maximum=100.0
    )
    cross_check_mode: str = _setting(
        "off",
        "cross_check.mode",
        "Answers of ~/distances that are run through FCL as well: none, a sample, or all.",
        choices=("off", "sample", "all"),
    )
    cross_check_sample_fraction: float = _setting(
        0.1,
        "cross_check.sample_fraction",
        "Share of the answers that the mode `sample` takes.",
        minimum=0.0,
        maximum=1.0,
    )
    cross_check_timeout: float = _setting(
        1.0,
        "cross_check.timeout",
        "Longest time for one answer of FCL; then its process is replaced.",
        unit="s",
        minimum=0.001,
        maximum=60.0,
    )

    def __post_init__(self) -> None:
        for setting, item in zip(settings(), fields(self), strict=True):
            fault = setting.fault(getattr(self, item.name), item.default)
            if fault:
                raise GeometryError(fault)
        if self.contacts_margin > 0.0 and self.accuracy not in (AUTO, "float64"):
            raise GeometryError(f"contacts.margin must be 0 at accuracy {self.accuracy}, got {self.contacts_margin:g}")
        if not self.camera_far > self.camera_near:
            raise GeometryError(f"camera.far must be > camera.near = {self.camera_near:g}, got {self.camera_far:g}")
        # Within float32 drift; what is left of it is normalised away.
        norm = math.hypot(*self.camera_pose[3:])
        if abs(norm - 1.0) > 1e-3:
            raise GeometryError(f"camera.pose must have a quaternion of norm 1, got {norm:.6g}")

    def changed(self, values: Mapping[str, Any]) -> Config:
        """A copy with other values, by parameter name."""
        names = {setting.name: item.name for setting, item in zip(settings(), fields(self), strict=True)}
        unknown = sorted(set(values) - set(names))
        if unknown:
            raise GeometryError(f"{unknown[0]} is no parameter")
        choices = {setting.name: setting.choices for setting in settings()}
        return replace(self, **{names[name]: _plain(value, choices[name]) for name, value in values.items()})

    @property
    def modes(self) -> dict[str, str]:
        """`effects.*` by the effect's name."""
        return {name.partition(".")[2]: value for name, value in self.by_name().items() if name.startswith("effects.")}

    def by_name(self) -> dict[str, Any]:
        """Values by parameter name, in the order of declaration."""
        return {setting.name: getattr(self, item.name) for setting, item in zip(settings(), fields(self), strict=True)}


def _plain(value: Any, choices: tuple[str, ...]) -> Any:
    """Lists of any kind as a tuple, so that a `Config` stays hashable; `on` and `off`, which YAML reads as booleans."""
    if isinstance(value, bool) and effects.OFF in choices:
        return effects.ON if value else effects.OFF
    return tuple(value) if isinstance(value, Sequence) and not isinstance(value, str) else value


def settings() -> tuple[Setting, ...]:
    """Every parameter's `Setting`, in the order of declaration."""
    items: tuple[Field[Any], ...] = fields(Config)
    return tuple(item.metadata["setting"] for item in items)
