# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Exact geometry, the judge of every kernel: `fractions.Fraction` and int only, nothing of geomsrv, no numpy.

The oracle is slow and obvious on purpose, and takes other routes than the engine: vertex enumeration and
hulls of Minkowski differences where the engine sweeps separating axes, projection on every feature where the
engine walks Voronoi regions.  Coordinates may be int, Fraction, float, "p/q" or `float.hex` text; they are
taken literally.
"""
