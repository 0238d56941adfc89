# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""geomsrv: cull, first contact and distance queries for robots, with proven error bounds.

Importable without ROS.  Everything public is re-exported here; see `geomsrv.queries` for the query functions,
`geomsrv.shapes` for the inputs, `geomsrv.answers` for the outputs, `geomsrv.scene` for worlds of named shapes.
"""

from geomsrv._version import __version__
from geomsrv.answers import (
    Booleans,
    Certificates,
    CollisionTimes,
    ContactStatus,
    Cost,
    Cull,
    CullState,
    Distances,
    DistanceStatus,
    FirstContacts,
    FrustumRegion,
)
from geomsrv.errors import CertificateError, GeometryError, NotAvailableError, SceneError
from geomsrv.footprint import time_to_collision
from geomsrv.queries import cull, distance, distance_to_frustum, first_contact, intersects
from geomsrv.region import Region
from geomsrv.scene import (
    PairContacts,
    PairDistances,
    Scene,
    SceneCull,
    SceneObject,
    SceneUpdate,
    Visibility,
)
from geomsrv.shapes import (
    Box,
    Boxes,
    Capsule,
    Cone,
    Convex,
    Cylinder,
    Ellipsoid,
    Frustum,
    Frustum2D,
    HalfSpace,
    Mesh,
    Point,
    Polygon,
    Polygons,
    Polytopes,
    Segment,
    Shape,
    Sphere,
    Triangle,
)
from geomsrv.trajectory import AcceleratedMotion, Trajectory, first_contact_along
from geomsrv.verify import verify, verify_record

__all__ = [
    "AcceleratedMotion",
    "Booleans",
    "Box",
    "Boxes",
    "Capsule",
    "CertificateError",
    "Certificates",
    "CollisionTimes",
    "Cone",
    "ContactStatus",
    "Convex",
    "Cost",
    "Cull",
    "CullState",
    "Cylinder",
    "DistanceStatus",
    "Distances",
    "Ellipsoid",
    "FirstContacts",
    "Frustum",
    "Frustum2D",
    "FrustumRegion",
    "GeometryError",
    "HalfSpace",
    "INSIDE",
    "INTERSECTS",
    "Mesh",
    "NEVER",
    "NotAvailableError",
    "OUTSIDE",
    "OVERLAPPING",
    "PairContacts",
    "PairDistances",
    "Point",
    "Polygon",
    "Polygons",
    "Polytopes",
    "Region",
    "Scene",
    "SceneCull",
    "SceneError",
    "SceneObject",
    "SceneUpdate",
    "Segment",
    "Shape",
    "Sphere",
    "TOUCHING",
    "Trajectory",
    "Triangle",
    "Visibility",
    "WILL_TOUCH",
    "__version__",
    "cull",
    "distance",
    "distance_to_frustum",
    "first_contact",
    "first_contact_along",
    "intersects",
    "time_to_collision",
    "verify",
    "verify_record",
]

OUTSIDE, INTERSECTS, INSIDE = CullState.OUTSIDE, CullState.INTERSECTS, CullState.INSIDE
NEVER, WILL_TOUCH = ContactStatus.NEVER, ContactStatus.WILL_TOUCH
TOUCHING, OVERLAPPING = ContactStatus.TOUCHING, ContactStatus.OVERLAPPING
