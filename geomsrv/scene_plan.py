# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""In words: what the queries of a scene compute for what is in it, and what they leave out and why."""

from __future__ import annotations

import numpy as np

from geomsrv.turning_pairs import followed_in_turning
from geomsrv.visibility import boxed_kinds
from geomsrv.world import World, supported_kinds

__all__ = ["describe"]


def describe(world: World, fixed_frame: str, allowed: int) -> str:
    """The plan, line by line; a line with a dash belongs to the query above it."""
    solids, polygons = world.families
    head = (
        f"scene {fixed_frame!r}, version {world.version}: {_count(len(solids), 'solid')}{_kinds(world)}, "
        f"{_count(len(polygons), 'polygon')}; {int((world.moves | world.turns).sum())} move, "
        f"{int(world.turns.sum())} of them turn; {_count(allowed, 'allowed pair')}"
    )
    return "\n".join([head, *_distances(world), *_first_contacts(world), *_cull(world)])


def _distances(world: World) -> list[str]:
    solids, polygons = (len(family) for family in world.families)
    pairs = solids * (solids - 1) // 2 + polygons * (polygons - 1) // 2
    if pairs == 0:
        return ["distances: skipped, there is no pair"]
    lines = [f"distances: bounding boxes choose from {_count(pairs, 'pair')}, kernels measure what is left"]
    if solids and polygons:
        lines.append(f"- polygons lie in the plane z = 0: {polygons} are compared with each other, never with solids")
    if missing := _missing(world):
        lines.append(f"- unsupported, no kernel: {', '.join(missing)}")
    return lines


def _first_contacts(world: World) -> list[str]:
    solids, polygons = world.families
    if max(len(solids), len(polygons)) < 2:
        return ["first contacts: skipped, there is no pair"]
    moving = world.moves | world.turns
    if not moving.any():
        return ["first contacts: nothing moves, nothing is swept; pairs are in contact now or never"]
    lines = [f"first contacts: boxes swept for {_count(int(moving.sum()), 'moving object')}"]
    sliding, known = moving & ~world.turns, world.polyhedra
    followed = [
        _count(int(number), name, plural)
        for number, name, plural in (
            (sliding[polygons].sum(), "polygon", ""),
            ((sliding & known)[solids].sum(), "box or hull", "boxes and hulls"),
        )
        if number
    ]
    if followed:
        lines.append(f"- followed in translation: {', '.join(followed)}")
    spinning = followed_in_turning(world)
    if turning := int((world.turns & spinning).sum()):
        lines.append(f"- followed while they turn, at tier float64: {_count(turning, 'object')}")
    elif not world.turns.any():
        lines.append("- rotation: skipped, no shape has angular velocity")
    if rolling := int((sliding & spinning & ~known)[solids].sum()):
        listed = _count(rolling, "round body, plane or mesh", "round bodies, planes and meshes")
        lines.append(f"- followed step by step, at tier float64: {listed}")
    if lost := int((world.turns & ~spinning)[polygons].sum()):
        lines.append(f"- unsupported unless in contact now: {_count(lost, 'polygon')} that move unpredictably")
    strange = int((moving & ~(known & sliding) & ~spinning)[solids].sum())
    if strange:
        lines.append(
            f"- unsupported unless in contact now: {_count(strange, 'moving solid')}, "
            "against whatever moves differently"
        )
    return lines


def _cull(world: World) -> list[str]:
    if len(world) == 0:
        return ["cull: skipped, there is no object"]
    lines = [f"cull: {_count(len(world), 'bounding box', 'bounding boxes')}, then the shapes whose box is cut"]
    if boxed := boxed_kinds(world):
        lines.append(f"- judged by their bounding box if that is cut, no kernel: {', '.join(boxed)}")
    return lines


def _kinds(world: World) -> str:
    """Solids by kind, in brackets."""
    counts = world.kind_counts(world.families[0])
    return f" ({', '.join(f'{name} {count}' for name, count in counts.items())})" if counts else ""


def _missing(world: World) -> list[str]:
    """Pairs of kinds that occur among the solids and have no kernel."""
    solids = world.families[0]
    kinds, first = np.unique(world.table.kind[world.shape[solids]], return_index=True)
    counts = world.kind_counts(solids)
    codes = world.kinds[solids][first]
    names = [world.table.kind_names[k] for k in kinds.tolist()]
    return [
        f"{a}-{b}"
        for i, a in enumerate(names)
        for j, b in enumerate(names)
        if i <= j and not supported_kinds()[codes[i], codes[j]] and (i < j or counts[a] > 1)
    ]


def _count(number: int, name: str, plural: str = "") -> str:
    """A number and what it counts: "1 solid", "2 solids"."""
    return f"{number} {name if number == 1 else plural or name + 's'}"
