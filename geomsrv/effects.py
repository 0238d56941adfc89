# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The effects of an evaluation, as a table: what asks for each, what it needs, and when a scene calls for it.

          asked for                   needs                  called for
    topics, `effects.x: on`  ->   other effects   ->   what the scene contains   ->   runs

`plan` is the least set of them for what is demanded now; each that is left out says why.  Nothing is computed here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

__all__ = [
    "AUTO",
    "CONTACTS",
    "DISTANCES",
    "EFFECTS",
    "MARKERS",
    "OFF",
    "ON",
    "VISIBLE",
    "Effect",
    "Situation",
    "Stage",
    "plan",
]

CONTACTS, DISTANCES, VISIBLE, MARKERS = "contacts", "distances", "visible", "markers"  #: topics that ask

AUTO, ON, OFF = "auto", "on", "off"  #: what a parameter `effects.x` can be


@dataclass(frozen=True)
class Situation:
    """What a plan depends on beside what is asked for: the configuration and the scene, in numbers."""

    accuracy: str
    horizon: float  #: [s]
    camera: bool  #: whether there is one
    moving: int  #: objects with a velocity
    turning: int  #: of these, objects that turn and can be followed
    cross_check: str  #: why there is none; empty if it can run


@dataclass(frozen=True)
class Effect:
    """One row of the table.

    Attributes
    ----------
    name : str
        That of its stage, and of its parameter `effects.<name>` if it is `optional`.
    gives : str
        What it adds to the answers, in words.
    topics : tuple of str
        Topics whose subscribers ask for it.
    needs : tuple of str
        Effects without which it has nothing to work on.
    absent : callable
        ``absent(situation)``: why the scene does not call for it; empty if it does.
    optional : bool
        Whether there is a parameter for it.
    """

    name: str
    gives: str
    topics: tuple[str, ...]
    needs: tuple[str, ...] = ()
    absent: Callable[[Situation], str] = lambda _: ""
    optional: bool = True


@dataclass(frozen=True)
class Stage:
    """One line of a plan: an effect, whether it runs, and why."""

    name: str
    active: bool
    reason: str


def _no_camera(now: Situation) -> str:
    return "" if now.camera else "no ~/camera_info yet"


def _no_motion(now: Situation) -> str:
    return "the horizon is 0" if now.horizon == 0.0 else "nothing moves" if now.moving == 0 else ""


def _no_turning(now: Situation) -> str:
    if now.turning == 0:
        return "no shape has angular velocity"
    return (
        "" if now.accuracy in ("auto", "float64") else f"turning objects are followed at float64, not at {now.accuracy}"
    )


def _no_second_opinion(now: Situation) -> str:
    return now.cross_check


# Top to bottom, as they run; needs point up.
EFFECTS = (
    Effect("cull", "what the camera sees", (VISIBLE,), absent=_no_camera),
    Effect("distance", "how far pairs are apart", (DISTANCES,)),
    Effect("witness", "nearest points and normals of distances", (DISTANCES,), ("distance",)),
    Effect("contact", "which pairs touch", (CONTACTS, MARKERS), optional=False),
    Effect("first_contact", "when moving pairs first touch", (CONTACTS, MARKERS), ("contact",), _no_motion),
    Effect("rotation", "first contact of what turns", (CONTACTS, MARKERS), ("first_contact",), _no_turning),
    Effect("contact_set", "the points of contact", (CONTACTS, MARKERS), ("contact",)),
    Effect("penetration", "how deep overlapping pairs are", (CONTACTS, DISTANCES, MARKERS)),
    Effect("cross_check", "a second opinion by FCL on distances", (DISTANCES,), ("distance",), _no_second_opinion),
    Effect(
        "motion_check",
        "a second opinion by FCL on first contacts",
        (CONTACTS, MARKERS),
        ("first_contact",),
        _no_second_opinion,
        optional=False,
    ),
    Effect("markers", "a drawing", (MARKERS,)),
)


def plan(asked: frozenset[str], modes: dict[str, str], now: Situation) -> list[Stage]:
    """Which effects run, and why the others do not.

    Parameters
    ----------
    asked : frozenset of str
        Topics that somebody listens to.
    modes : dict of str to str
        `AUTO`, `ON` or `OFF` of each optional effect: on is asked for though nobody listens, off never runs.
    now : Situation

    Examples
    --------
    >>> from geomsrv.effects import DISTANCES, Situation, plan
    >>> resting = Situation("float64", horizon=2.0, camera=False, moving=0, turning=0, cross_check="the mode is off")
    >>> for stage in plan(frozenset({DISTANCES}), {"witness": "off"}, resting)[:4]:
    ...     print(stage.name, stage.active, stage.reason)
    cull False nobody listens to ~/visible
    distance True asked for by ~/distances
    witness False switched off by effects.witness
    contact False nobody listens to ~/contacts or ~/markers
    """
    # A topic whose own effect is switched off asks for nothing.
    heard = asked - {effect.name for effect in EFFECTS if modes.get(effect.name) == OFF}
    stages: dict[str, Stage] = {}
    for effect in EFFECTS:
        mode = modes.get(effect.name, AUTO)
        listeners = [topic for topic in effect.topics if topic in heard]
        missing = [stages[name] for name in effect.needs if not stages[name].active]
        if mode == OFF:
            stage = Stage(effect.name, False, f"switched off by effects.{effect.name}")
        elif not listeners and mode != ON and not _wanted_by(effect.name, modes):
            stage = Stage(
                effect.name, False, f"nobody listens to {' or '.join(f'~/{topic}' for topic in effect.topics)}"
            )
        elif missing:
            stage = Stage(effect.name, False, missing[0].reason)
        elif reason := effect.absent(now):
            stage = Stage(effect.name, False, reason)
        elif listeners:
            stage = Stage(effect.name, True, f"asked for by {' and '.join(f'~/{topic}' for topic in listeners)}")
        else:
            stage = Stage(effect.name, True, f"switched on by effects.{_switch(effect.name, modes)}")
        stages[effect.name] = stage
    return list(stages.values())


def _wanted_by(name: str, modes: dict[str, str]) -> str:
    """An effect that is switched on and needs this one; empty if there is none."""
    for effect in EFFECTS:
        if name in effect.needs and (modes.get(effect.name) == ON or _wanted_by(effect.name, modes)):
            return effect.name
    return ""


def _switch(name: str, modes: dict[str, str]) -> str:
    """The switch that turned an effect on."""
    return name if modes.get(name) == ON else _switch(_wanted_by(name, modes), modes)
