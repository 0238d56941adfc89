# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Every exception geomsrv raises on purpose.  Nothing else lives here."""

from __future__ import annotations

from geomsrv.verify import CertificateError  # defined there, as the checker needs no other file

__all__ = ["CertificateError", "GeometryError", "NotAvailableError", "SceneError"]


class GeometryError(ValueError):
    """Bad input: the message names the argument, the item's index and what was wrong with it."""


class NotAvailableError(GeometryError, NotImplementedError):
    """A valid request for something this version does not offer yet; the message names it."""


class SceneError(GeometryError):
    """A scene update was refused as a whole; the scene is as it was.

    Attributes
    ----------
    errors : dict of str to str
        What was wrong, by object id.
    """

    def __init__(self, errors: dict[str, str]) -> None:
        self.errors = dict(errors)
        super().__init__("; ".join(f"{name!r}: {fault}" for name, fault in self.errors.items()))
