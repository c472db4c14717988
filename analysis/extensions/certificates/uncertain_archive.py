"""A certificate as an archive of uncertain numbers that the GUM Tree Calculator (GTC) reads.

The format is that of its JSON archives, version 1.5: each co-ordinate is an elementary uncertain
number with its correlations; one without uncertainty is a constant.
"""

from __future__ import annotations

import hashlib
import json
from typing import Any

import numpy as np

from .certificate_csv import coordinate_names
from .certified_balls import CertifiedBalls

VERSION = "https://measurement.govt.nz/gtc/json_1.5.0"


def gtc_archive(certificate: CertifiedBalls) -> str:
    """The co-ordinates in metres as uncertain real numbers with their names as tags, such as
    "r1c1 x".
    """
    names = coordinate_names(certificate)
    values = certificate.coordinates.ravel().tolist()
    u = certificate.standard_uncertainties.ravel()
    uncertain = np.flatnonzero(u > 0.0)
    safe = np.where(u > 0.0, u, 1.0)
    correlation = np.clip(certificate.covariance / np.outer(safe, safe), -1.0, 1.0)
    # Numbers of one certificate are the same in all its archives, and no others'.
    content = certificate.coordinates.tobytes() + certificate.covariance.tobytes()
    origin = int(hashlib.sha256(certificate.fingerprint.encode() + content).hexdigest()[:32], 16)
    identifiers = {k: f"({origin}, {i})" for i, k in enumerate(uncertain.tolist(), 1)}
    freedom = certificate.degrees_of_freedom
    ensemble = {}
    if np.isfinite(freedom):
        # Of numbers that are correlated and known from one scatter (GTC, ensembles).
        ensemble = {"ensemble": list(identifiers.values())}
    leaves = {
        identifier: {
            "CLASS": "LeafNode",
            "uid": identifier,
            "label": names[k],
            "u": float(u[k]),
            "df": freedom if np.isfinite(freedom) else None,
            "independent": False,
            "correlation": {
                identifiers[j]: 1.0 if j == k else float(correlation[k, j])
                for j in uncertain.tolist()
            },
            **ensemble,
        }
        for k, identifier in identifiers.items()
    }
    tagged = {
        name: (
            {"CLASS": "ElementaryReal", "x": values[k], "uid": identifiers[k]}
            if k in identifiers
            else _constant(values[k], names[k], f"({origin}, {len(names) + k})")
        )
        for k, name in enumerate(names)
    }
    archive = {
        "CLASS": "Archive",
        "version": VERSION,
        "leaf_nodes": leaves,
        "tagged_real": tagged,
        "tagged_complex": {},
        "untagged_real": {},
        "intermediate_uids": {
            number["uid"]: [number["label"], 0.0, None]
            for number in tagged.values()
            if "label" in number
        },
    }
    return json.dumps(archive, indent=1) + "\n"


def _constant(value: float, name: str, identifier: str) -> dict[str, Any]:
    """A number that depends on nothing uncertain."""
    empty = {"CLASS": "Vector", "index": [], "value": []}
    return {
        "CLASS": "IntermediateReal",
        "value": value,
        "label": name,
        "uid": identifier,
        "u_components": empty,
        "d_components": empty,
        "i_components": empty,
    }
