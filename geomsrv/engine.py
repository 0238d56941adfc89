# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What the node evaluates, without ROS: a scene, a camera, a cross-check, and a plan of what is worth computing.

The plan has three sources: what the configuration allows, what is asked for now, and what the scene contains.  A stage
that is not active is never entered, and the counters prove it.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv.answers import Cost
from geomsrv.config import Config
from geomsrv.crosscheck import CrossCheck
from geomsrv.effects import CONTACTS, DISTANCES, OFF, ON, VISIBLE, Situation, Stage, plan
from geomsrv.pairwise import ListedContacts, ListedDistances
from geomsrv.scene import PairContacts, PairDistances, Scene, SceneCull, SceneUpdate
from geomsrv.shapes import Frustum
from geomsrv.turning_pairs import followed_in_turning
from geomsrv.world import World

__all__ = ["Engine", "Evaluation", "SceneContacts", "Totals"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SceneContacts:
    """Pairs that touch now or within the horizon.

    Attributes
    ----------
    pairs : PairContacts
    depth : (n,) float64
        Penetration depth of every pair now [m]; NaN where it was not computed.
    horizon : float
        [s]
    margin : float
        Pairs that come as near as this are in contact [m].
    checked : int
        Pairs of the scene that are not allowed to touch.
    """

    pairs: PairContacts
    depth: FloatArray
    horizon: float
    margin: float
    checked: int


class Totals:
    """What queries cost since the start, by name and tier."""

    def __init__(self) -> None:
        self.rows: dict[tuple[str, str], tuple[int, int, int]] = {}  #: calls, items, time [ns]

    def add(self, query: str, cost: Cost, items: int) -> None:
        """Count one call."""
        calls, total, spent = self.rows.get((query, cost.accuracy), (0, 0, 0))
        self.rows[query, cost.accuracy] = calls + 1, total + items, spent + cost.elapsed_ns


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Answers of one evaluation; None where the plan says no."""

    contacts: SceneContacts | None = None
    distances: PairDistances | None = None
    visible: SceneCull | None = None


class Engine:
    """A scene, a camera and a cross-check, evaluated by a plan.

    Parameters
    ----------
    config : Config
    transforms : callable, optional
        As for `Scene`.

    Attributes
    ----------
    scene : Scene
    config : Config
    camera : Frustum or None
        In the fixed frame.
    stamp : object
        Time of the newest input, as it came; None before.
    counters : Counter
        How often each stage ran, by name.
    totals : Totals
    cross_check : CrossCheck
    failing : bool
        Whether the last evaluation raised.
    """

    def __init__(self, config: Config, transforms: Callable[[str], ArrayLike] | None = None) -> None:
        self.scene = Scene(fixed_frame=config.fixed_frame, transforms=transforms)
        self.config = config
        self.camera: Frustum | None = None
        self.stamp: Any = None
        self._states_came = math.nan  # clock of the last ~/states [s]
        self.counters: Counter[str] = Counter()
        self.totals = Totals()
        self.cross_check = _cross_check(config)
        self.failing = False

    def configure(self, config: Config) -> None:
        """Change the configuration; the scene stays."""
        before, self.config = self.config, config
        if _cross_check_settings(before) != _cross_check_settings(config):
            self.cross_check.close()
            self.cross_check = _cross_check(config)

    def close(self) -> None:
        """Stop the cross-check's process."""
        self.cross_check.close()

    # ------------------------------------------------------------------------------------------------------ inputs

    def apply(self, update: SceneUpdate, stamp: Any = None) -> int:
        """Change the scene as a whole or not at all; returns its version."""
        version = self.scene.apply(update)
        self.stamp = stamp
        self.counters["updates"] += 1
        return version

    def set_states(self, ids: Sequence[str], poses: ArrayLike, twists: ArrayLike | None, stamp: Any = None) -> int:
        """Move objects; returns the scene's version."""
        version = self.scene.set_states(ids, poses, twists, stamp)
        self._states_came = time.monotonic()
        self.stamp = stamp
        self.counters["states"] += 1
        return version

    @property
    def input_age(self) -> float:
        """Seconds since states came; NaN if none ever did."""
        return time.monotonic() - self._states_came

    @property
    def stale(self) -> bool:
        """Whether a stream of states had begun and has been silent for too long."""
        return self.input_age > self.config.states_timeout

    @property
    def moving_count(self) -> int:
        """Number of objects with a velocity."""
        world = self.scene.world
        return int((world.moves | world.turns).sum())

    # ---------------------------------------------------------------------------------------------------- the plan

    @property
    def turning_count(self) -> int:
        """Number of objects that turn and can be followed while they do."""
        world = self.scene.world
        return int((world.turns & followed_in_turning(world)).sum())

    def plan(self, asked: frozenset[str]) -> list[Stage]:
        """Which effects an evaluation runs, and why.

        Parameters
        ----------
        asked : frozenset of str
            Topics that somebody listens to: those of `geomsrv.effects`.
        """
        config, check = self.config, self.cross_check
        off = "cross_check.mode is off" if check.mode == "off" else "" if check.available else check.reason
        now = Situation(
            config.accuracy, config.horizon, self.camera is not None, self.moving_count, self.turning_count, off
        )
        return plan(asked, config.modes, now)

    # -------------------------------------------------------------------------------------------------- evaluation

    def evaluate(self, asked: frozenset[str]) -> Evaluation:
        """Answers for the topics that somebody listens to, `asked` as for `plan`."""
        return Evaluation(**dict(self.steps(asked)))

    def steps(self, asked: frozenset[str]) -> Iterator[tuple[str, Any]]:
        """The same one by one, topic and answer, for those who have other things to do in between."""
        on = frozenset(stage.name for stage in self.plan(asked) if stage.active)
        self.counters["evaluations"] += 1
        for topic, stage, answer in (
            (CONTACTS, "contact", self._contacts),
            (DISTANCES, "distance", self._distances),
            (VISIBLE, "cull", self._visible),
        ):
            if stage in on:
                try:
                    found = answer(on)
                except Exception:
                    self.counters["evaluations failed"] += 1
                    self.failing = True
                    raise
                yield topic, found
        self.failing = False

    def _visible(self, _: frozenset[str]) -> SceneCull:
        assert self.camera is not None  # the plan says so
        self.counters["cull"] += 1
        seen = self.scene.cull(self.camera, accuracy=self.config.accuracy)
        self.totals.add("~/visible", seen.cost, len(seen.ids))
        return seen

    def _distances(self, on: frozenset[str]) -> PairDistances:
        self.counters["distance"] += 1
        want = ["distance", *(effect for effect in ("witness", "penetration") if effect in on)]
        for effect in want[1:]:
            self.counters[effect] += 1
        answer = self.scene.distances(self.config.max_distance, want=want, accuracy=self.config.accuracy)
        self.totals.add("~/distances", answer.cost, len(answer))
        if "cross_check" in on:
            self.counters["cross_check"] += 1
            self.cross_check.submit_scene(self.scene, answer)
        if "witness" not in on:
            nowhere = np.full_like(answer.normal, np.nan)
            answer = replace(answer, point_a=nowhere, point_b=nowhere, normal=nowhere)
        return answer

    def _contacts(self, on: frozenset[str]) -> SceneContacts:
        self.counters["contact"] += 1
        # If nothing moves the scene sweeps nothing, and the present holds until the horizon.
        horizon = self.config.horizon if self.config.effects_first_contact != OFF else 0.0
        self.counters["first_contact"] += "first_contact" in on
        self.counters["rotation"] += "rotation" in on
        self.counters["contact_set"] += "contact_set" in on
        margin, earliest = self.config.contacts_margin, self.config.contacts_earliest
        pairs = self.scene.first_contacts(
            horizon,
            margin=margin,
            earliest=earliest,
            accuracy=self.config.accuracy,
            contact_set="contact_set" in on,
            rotation=self.config.effects_rotation != OFF,
        )
        depth = np.full(len(pairs), np.nan)
        if "penetration" in on and (pairs.time == 0.0).any():
            self.counters["penetration"] += 1
            depth = _depths(pairs, self.scene.contacts(accuracy=self.config.accuracy))
        self.totals.add("~/contacts", pairs.cost, len(pairs))
        if "motion_check" in on and margin == 0.0:
            self.check_scene_motion(pairs, horizon)
        counts = pairs.cost.counts
        return SceneContacts(pairs, depth, horizon, margin, counts.get("pairs", 0) - counts.get("allowed", 0))

    def check(self, world: World, pairs: IntArray, answer: PairDistances | ListedDistances) -> None:
        """Hand distances of (n, 2) rows of `world` to the cross-check, if it is on."""
        if self.cross_check.mode != "off":
            self.counters["cross_check"] += 1
            self.cross_check.submit_pairs(world, pairs, answer)

    def check_motion(
        self, world: World, pairs: IntArray, answer: PairContacts | ListedContacts, horizon: float
    ) -> None:
        """Hand first contacts, without a margin, of (n, 2) rows of `world` to the cross-check, if it is on."""
        if self.cross_check.mode != "off":
            self.counters["motion_check"] += 1
            self.cross_check.submit_motion(world, pairs, answer, horizon)

    def check_scene_motion(self, answer: PairContacts, horizon: float) -> None:
        """The same of an answer of the scene, unless that has changed since."""
        world = self.scene.world
        if self.cross_check.mode != "off" and world.version == answer.version:
            rows = [(world.index[a], world.index[b]) for a, b in zip(answer.ids_a, answer.ids_b, strict=True)]
            self.check_motion(world, np.array(rows, np.int64).reshape(-1, 2), answer, horizon)


def _depths(pairs: PairContacts, now: PairDistances) -> FloatArray:
    """Penetration depth of each pair; 0 for a pair that just touches, NaN for one that does not touch now."""
    depth = {(a, b): -min(d, 0.0) for a, b, d in zip(now.ids_a, now.ids_b, now.distance.tolist(), strict=True)}
    return np.array([depth.get(pair, np.nan) for pair in zip(pairs.ids_a, pairs.ids_b, strict=True)])


def _cross_check_settings(config: Config) -> tuple[str, float, float]:
    mode = config.cross_check_mode
    if config.effects_cross_check == OFF or (config.effects_cross_check == ON and mode == "off"):
        mode = "off" if config.effects_cross_check == OFF else "all"
    return mode, config.cross_check_sample_fraction, config.cross_check_timeout


def _cross_check(config: Config) -> CrossCheck:
    mode, fraction, timeout = _cross_check_settings(config)
    return CrossCheck(mode, sample_fraction=fraction, timeout_s=timeout)
