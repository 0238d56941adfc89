# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The demo's picture: the cell in 3D with what the camera sees, the floor plan with what will touch.  Drawing only."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np  # noqa: E402
import trimesh  # noqa: E402
from matplotlib import pyplot as plt  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.patches import Patch, Polygon  # noqa: E402
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection  # noqa: E402

import geomsrv as gs  # noqa: E402

INSIDE, PARTLY, UNSEEN, MOVING = "#2a9d8f", "#e9c46a", "#c9c9c9", "#6d597a"
VIEW, CONTACT, NEAREST, SWUNG = "#1d6fb8", "#d62828", "#111111", "#8a1c7c"
BODIES = ("#4d6cfa", "#f3722c", "#43aa8b", "#9b5de5", "#577590")


@dataclass
class PlannedContact:
    """A predicted contact of two planar bodies."""

    id_a: str
    id_b: str
    time: float
    points: np.ndarray  #: (k, 2)
    normal: np.ndarray  #: (2,)


@dataclass
class Picture:
    """Everything that is drawn."""

    objects: Sequence[gs.SceneObject]
    states: Mapping[str, int]  #: id -> CullState, of the objects the camera judged
    frustum: gs.Frustum
    nearest: tuple[np.ndarray, np.ndarray, str] | None = None  #: the two points and a label
    touching: Sequence[np.ndarray] = ()  #: contact points in 3D
    swung: Sequence[gs.SceneObject] = ()  #: the arm where it will touch
    swing: tuple[np.ndarray, np.ndarray, str] | None = None  #: contact points (k, 3), normal, and a label
    footprints: Mapping[str, Callable[[float], np.ndarray]] = field(default_factory=dict)  #: id -> ring at a time
    planned: Sequence[PlannedContact] = ()
    scan: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))  #: (n, 2)
    collision: PlannedContact | None = None  #: of the robot with the scan


def _mesh(shape: gs.Shape) -> trimesh.Trimesh | None:
    """Triangles to draw; None for what has no end."""
    if isinstance(shape, gs.Sphere):
        return trimesh.creation.icosphere(subdivisions=2, radius=shape.radius)
    if isinstance(shape, gs.Capsule):
        return trimesh.creation.capsule(height=shape.length, radius=shape.radius, count=[16, 16])
    if isinstance(shape, gs.Box):
        return trimesh.creation.box(2.0 * shape.half_extents)
    if isinstance(shape, gs.Convex):
        return trimesh.Trimesh(shape.vertices).convex_hull
    return None


def _placed(item: gs.SceneObject, points: np.ndarray) -> np.ndarray:
    position, (x, y, z, w) = np.asarray(item.pose[:3]), item.pose[3:]
    rotation = trimesh.transformations.quaternion_matrix([w, x, y, z])[:3, :3]
    return points @ rotation.T + position


def _draw_cell(axes: plt.Axes, picture: Picture) -> None:
    # Drawn back to front by hand: furniture, then what stands on it, then lines; matplotlib sorts whole objects badly.
    axes.computed_zorder = False
    for item in picture.objects:
        mesh = _mesh(item.shape)
        if mesh is None:
            continue
        state = picture.states.get(item.id)
        color = {gs.INSIDE: INSIDE, gs.INTERSECTS: PARTLY, gs.OUTSIDE: UNSEEN, None: UNSEEN}[state]
        triangles = _placed(item, mesh.vertices)[mesh.faces]
        furniture = "table" in item.id
        axes.add_collection3d(
            Poly3DCollection(triangles, facecolors=color, alpha=0.7 if furniture else 0.95, shade=True),
            zs=0,
        )
        axes.collections[-1].set_zorder(1 if furniture else 2 - 0.1 * np.mean(triangles[..., 1]))
    corners = picture.frustum.corners()
    edges = [(0, 1), (1, 3), (3, 2), (2, 0)]
    lines = [(corners[i + k], corners[j + k]) for i, j in edges for k in (0, 4)]
    lines += [(picture.frustum.origin, corners[i]) for i in range(4)]
    lines += [(corners[i], corners[i + 4]) for i in range(4)]
    axes.add_collection3d(Line3DCollection(lines, colors=VIEW, linewidths=0.8, zorder=4))
    axes.scatter(*picture.frustum.origin, color=VIEW, marker="s", s=25, zorder=4)
    nearest = "nearest pair"
    if picture.nearest is not None:
        a, b, label = picture.nearest
        axes.plot(*np.array([a, b]).T, color=NEAREST, linewidth=2.5, marker="o", markersize=4, zorder=6)
        nearest = f"nearest: {label}"
    for item in picture.swung:
        if (mesh := _mesh(item.shape)) is not None:
            triangles = _placed(item, mesh.vertices)[mesh.faces]
            axes.add_collection3d(Poly3DCollection(triangles, facecolors=SWUNG, alpha=0.3, zorder=1.5))
    for point in picture.touching:
        axes.scatter(*point, color=CONTACT, s=30, depthshade=False, zorder=7)
    swing = "first contact of the arm"
    if picture.swing is not None:
        points, normal, swing = picture.swing
        axes.scatter(*points.T, color=SWUNG, marker="D", s=36, depthshade=False, zorder=8)
        axes.quiver(*points.mean(axis=0), *(0.25 * normal), color=SWUNG, linewidth=2.0, zorder=8)
    axes.set(xlim=(-0.5, 1.8), ylim=(-1.0, 1.0), zlim=(-0.75, 1.1), xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set_box_aspect((2.3, 2.0, 1.85), zoom=1.1)
    axes.view_init(elev=22, azim=-112)
    axes.legend(
        handles=[
            Patch(color=INSIDE, label="inside the view"),
            Patch(color=PARTLY, label="partly in view"),
            Patch(color=UNSEEN, label="outside"),
            Line2D([], [], color=VIEW, marker="s", markersize=4, label="camera and its frustum"),
            Line2D([], [], color=NEAREST, marker="o", markersize=4, label=nearest),
            Line2D([], [], color=CONTACT, marker="o", linestyle="", label="contact now"),
            Line2D([], [], color=SWUNG, marker="D", markersize=5, label=swing),
        ],
        loc="upper center",
        ncols=2,
        fontsize=8,
        framealpha=0.9,
    )


def _draw_plan(axes: plt.Axes, picture: Picture) -> None:
    contacts = [*picture.planned, *([picture.collision] if picture.collision is not None else [])]
    for (name, at), color in zip(picture.footprints.items(), BODIES, strict=False):
        ring = at(0.0)
        axes.add_patch(Polygon(ring, closed=True, facecolor=color, alpha=0.55, edgecolor=color))
        center = ring.mean(axis=0)
        axes.annotate(name, center, xytext=(0, -12), textcoords="offset points", ha="center", fontsize=7, zorder=5)
        for time in [c.time for c in contacts if name in (c.id_a, c.id_b)]:
            axes.add_patch(Polygon(at(time), closed=True, fill=False, linestyle="--", edgecolor=color))
        way = np.array([at(time).mean(axis=0) for time in np.linspace(0.0, 1.0, 12)])
        if np.ptp(way, axis=0).any():
            axes.plot(*way.T, color=color, linewidth=1.8)
            arrow = {"arrowstyle": "->", "color": color, "linewidth": 1.8}
            axes.annotate("", way[-1] + (way[-1] - way[-2]), way[-2], arrowprops=arrow)
    axes.plot(*picture.scan.T, color=NEAREST, marker=".", markersize=3, linestyle="")
    for contact in contacts:
        axes.plot(*contact.points.T, color=CONTACT, marker="o", markersize=5, linewidth=3, zorder=8)
        middle = contact.points.mean(axis=0)
        if not np.isnan(contact.normal).any():
            arrow = {"arrowstyle": "->", "color": CONTACT}
            axes.annotate("", middle + 0.35 * contact.normal, middle, arrowprops=arrow, zorder=8)
        axes.annotate(
            f"{contact.time:.2f} s", middle, xytext=(8, -14), textcoords="offset points", color=CONTACT, fontsize=9
        )
    axes.autoscale_view()
    axes.margins(0.08)
    axes.set_aspect("equal")
    axes.grid(alpha=0.3)
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.legend(
        handles=[
            Patch(facecolor=BODIES[0], alpha=0.55, label="body now"),
            Line2D([], [], color=BODIES[0], linewidth=1.8, label="its way in the next second"),
            Line2D([], [], color=BODIES[0], linestyle="--", label="body at first contact"),
            Line2D([], [], color=CONTACT, marker="o", label="contact set and normal"),
            Line2D([], [], color=NEAREST, marker=".", linestyle="", label="laser scan"),
        ],
        loc="best",
        fontsize=8,
    )


def draw(picture: Picture, path: Path) -> None:
    """Write the picture."""
    figure = plt.figure(figsize=(14, 6.6), layout="constrained")
    grid = figure.add_gridspec(1, 2, width_ratios=(1.15, 1.0))
    cell, plan = figure.add_subplot(grid[0], projection="3d"), figure.add_subplot(grid[1])
    cell.set_title("what the camera sees, what is near, what touches, what the swinging arm will hit")
    plan.set_title("a robot on an arc: who touches whom, when and where")
    _draw_cell(cell, picture)
    _draw_plan(plan, picture)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)
