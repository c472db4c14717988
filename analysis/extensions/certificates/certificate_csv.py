"""Tables of a certificate: those that a calibration item of an experiment reads as `values` and
`covariance`.
"""

from __future__ import annotations

import io
from decimal import Decimal

from ballplate.simulator.inputs import CsvWriter, in_one_line

from .certified_balls import CertifiedBalls


def coordinates_csv(certificate: CertifiedBalls, covariance: str) -> str:
    """Co-ordinates with their standard uncertainties, below comments; `covariance` is the name of
    the table with these.
    """
    axes = "xyz"[: certificate.dimension]
    comments = [f"{key}: {text}" for key, text in certificate.facts.items()]
    comments += [f"covariance: {covariance}", *certificate.notes]
    stream = io.StringIO()
    stream.writelines(f"# {in_one_line(text)}\n" for text in comments)
    writer = CsvWriter(stream)
    heads = [
        *(f"{axis}_mm" for axis in axes),
        *(f"{axis}_standard_uncertainty_um" for axis in axes),
    ]
    writer.writerow(["ball", *heads])
    for name, place, u in zip(
        certificate.names,
        certificate.coordinates.tolist(),
        certificate.standard_uncertainties.tolist(),
        strict=True,
    ):
        writer.writerow(
            [name, *(scaled(value, 3) for value in place), *(scaled(value, 6) for value in u)]
        )
    return stream.getvalue()


def covariance_csv(certificate: CertifiedBalls) -> str:
    """The covariance of all co-ordinates, in square micrometres."""
    names = coordinate_names(certificate)
    stream = io.StringIO()
    writer = CsvWriter(stream)
    writer.writerow(["covariance_um2", *names])
    for name, row in zip(names, certificate.covariance.tolist(), strict=True):
        writer.writerow([name, *(scaled(value, 12) for value in row)])
    return stream.getvalue()


def coordinate_names(certificate: CertifiedBalls) -> list[str]:
    """Names of all co-ordinates, by ball and axis."""
    return [
        f"{name} {axis}" for name in certificate.names for axis in "xyz"[: certificate.dimension]
    ]


def scaled(value: float, digits: int) -> str:
    """A number times a power of ten, so that reading it gives the same float.

    >>> scaled(0.75, 3), scaled(-1.25e-7, 6), scaled(1e-28, 0)
    ('750', '-0.125', '1e-28')
    """
    text = f"{Decimal(repr(value + 0.0)).scaleb(digits).normalize():f}"
    return text if len(text) < 30 else f"{Decimal(repr(value)).scaleb(digits).normalize():e}"
