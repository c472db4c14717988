"""A certificate as a Digital Calibration Certificate (DCC): XML in the schema of the
Physikalisch-Technische Bundesanstalt, version 3.1.2, with quantities in the D-SI format, 2.1.
"""

from __future__ import annotations

import re
from datetime import date
from importlib.metadata import version
from xml.sax.saxutils import escape

import numpy as np
from ballplate.simulator.computing import lstsq
from ballplate.simulator.inputs import in_one_line

from .certificate_csv import coordinate_names, scaled
from .certified_balls import NO_ACCREDITATION, PlateCertificate

VERSION = "3.1.2"
HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<dcc:digitalCalibrationCertificate xmlns:dcc="https://ptb.de/dcc" xmlns:si="https://ptb.de/si"'
    ' xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="https://ptb.de/dcc'
    f' https://ptb.de/dcc/v{VERSION}/dcc.xsd" schemaVersion="{VERSION}">'
)
MILLIMETRE, SQUARE = "\\milli\\metre", "\\milli\\metre\\tothe{2}"
# What XML cannot hold.
FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def digital_certificate(certificate: PlateCertificate) -> str:
    """The certificate in XML; co-ordinates with expanded uncertainties and their covariance.

    :raises ValueError: when, or in which country, the plate was measured is not stated; a coverage
        factor below 1, which the schema does not admit.
    """
    if certificate.coverage_factor < 1.0:
        raise ValueError(
            f"a DCC has coverage factors of 1 and above, not {certificate.coverage_factor:g}"
        )
    parts = [
        HEAD,
        _administrative(certificate),
        "<dcc:measurementResults><dcc:measurementResult>",
        _name(f"Ball co-ordinates of {certificate.artefact}"),
        f"<dcc:description>{''.join(map(_content, _told(certificate)))}</dcc:description>",
        _temperature(certificate),
        "<dcc:results>",
        f'<dcc:result id="coordinates">{_name("Co-ordinates of balls")}',
        f"<dcc:data><dcc:quantity>{_coordinates(certificate)}</dcc:quantity></dcc:data>"
        "</dcc:result>",
        _distances(certificate),
        "</dcc:results></dcc:measurementResult></dcc:measurementResults>",
        "</dcc:digitalCalibrationCertificate>\n",
    ]
    return "\n".join(part for part in parts if part)


def _told(certificate: PlateCertificate) -> list[str]:
    comments = [f"{key}: {text}" for key, text in certificate.facts.items()]
    return [*comments, *certificate.notes]


def _text(text: str) -> str:
    return escape(FORBIDDEN.sub("\ufffd", in_one_line(text)))


def _content(text: str) -> str:
    return f'<dcc:content lang="en">{_text(text)}</dcc:content>'


def _name(text: str) -> str:
    return f"<dcc:name>{_content(text)}</dcc:name>"


def _dates(text: str) -> tuple[str, str]:
    """The first and the last day of a measurement.

    :raises ValueError: they are not stated, or are no dates.

    >>> _dates("2026-11-02/2026-11-03")
    ('2026-11-02', '2026-11-03')
    """
    first, _, last = text.partition("/")
    try:
        start_and_end = (
            date.fromisoformat(first.strip()),
            date.fromisoformat((last or first).strip()),
        )
    except ValueError:
        problem = f'"{text}" is no date' if text else "a DCC states when the plate was measured"
        raise ValueError(
            f"{problem}; state it as date, such as 2026-11-02 or 2026-11-02/2026-11-03"
        ) from None
    if start_and_end[0] > start_and_end[1]:
        raise ValueError(f"date {text} ends before it begins")
    return start_and_end[0].isoformat(), start_and_end[1].isoformat()


def _administrative(certificate: PlateCertificate) -> str:
    about = certificate.about
    first, last = _dates(about["date"])
    if not re.fullmatch("[A-Z]{2}", about["country"]):
        problem = f'"{about["country"]}" is none' if about["country"] else "it is not stated"
        raise ValueError(
            f"a DCC states the country by its two capital letters, such as country=DE; {problem}"
        )
    issuer, value = "owner", about["serial number"]
    where = f"<dcc:location><dcc:city>{_text(about['city'])}</dcc:city></dcc:location>"
    mail = f"<dcc:eMail>{_text(about['e-mail'])}</dcc:eMail>"
    return "\n".join(
        [
            "<dcc:administrativeData>",
            f"<dcc:dccSoftware><dcc:software>{_name('ballplate')}<dcc:release>"
            f"{_text(version('ballplate'))}</dcc:release></dcc:software></dcc:dccSoftware>",
            "<dcc:coreData>",
            f"<dcc:countryCodeISO3166_1>{about['country']}</dcc:countryCodeISO3166_1>",
            "<dcc:usedLangCodeISO639_1>en</dcc:usedLangCodeISO639_1>",
            "<dcc:mandatoryLangCodeISO639_1>en</dcc:mandatoryLangCodeISO639_1>",
            f"<dcc:uniqueIdentifier>{_text(certificate.identifier)}</dcc:uniqueIdentifier>",
            f"<dcc:beginPerformanceDate>{first}</dcc:beginPerformanceDate>",
            f"<dcc:endPerformanceDate>{last}</dcc:endPerformanceDate>",
            "<dcc:performanceLocation>other</dcc:performanceLocation>",
            "</dcc:coreData>",
            f"<dcc:items><dcc:item>{_name(f'ball plate {certificate.artefact}')}",
            f"<dcc:manufacturer>{_name(about['manufacturer'])}</dcc:manufacturer>",
            f"<dcc:identifications><dcc:identification><dcc:issuer>{issuer}</dcc:issuer>"
            f"<dcc:value>{_text(value)}</dcc:value>{_name('serial number')}"
            "</dcc:identification></dcc:identifications></dcc:item></dcc:items>",
            f"<dcc:calibrationLaboratory><dcc:contact>{_name(about['laboratory'])}{mail}{where}"
            "</dcc:contact></dcc:calibrationLaboratory>",
            f"<dcc:respPersons><dcc:respPerson><dcc:person>{_name(about['person'])}</dcc:person>"
            "</dcc:respPerson></dcc:respPersons>",
            f"<dcc:customer>{_name(about['customer'])}<dcc:eMail>not stated</dcc:eMail>"
            "<dcc:location><dcc:city>not stated</dcc:city></dcc:location></dcc:customer>",
            f"<dcc:statements><dcc:statement><dcc:declaration>{_content(NO_ACCREDITATION)}"
            "</dcc:declaration></dcc:statement></dcc:statements>",
            "</dcc:administrativeData>",
        ]
    )


def _temperature(certificate: PlateCertificate) -> str:
    """The temperature that lengths are stated for; nothing where it is unknown."""
    if certificate.reference_temperature is None:
        return ""
    return (
        '<dcc:influenceConditions><dcc:influenceCondition refType="basic_temperature">'
        f"{_name('reference temperature')}<dcc:data><dcc:quantity><si:real><si:value>"
        f"{certificate.reference_temperature:g}</si:value><si:unit>\\degreecelsius</si:unit>"
        "</si:real></dcc:quantity></dcc:data></dcc:influenceCondition></dcc:influenceConditions>"
    )


def _labels(names: list[str]) -> str:
    """Names without spaces, which separate them."""
    return " ".join(re.sub(r"\s+", "_", _text(name)) for name in names)


def _coordinates(certificate: PlateCertificate) -> str:
    covariance = certificate.covariance
    entries = [
        "<si:column>"
        + "".join(
            f"<si:covariance><si:value>{scaled(value, 6)}</si:value><si:unit>{SQUARE}</si:unit>"
            "</si:covariance>"
            for value in column
        )
        + "</si:column>"
        for column in covariance.T.tolist()
    ]
    k = _ellipsoid_factor(certificate)
    region = (
        "<si:ellipsoidalRegionXMLList>\n<si:covarianceMatrix>\n"
        + "\n".join(entries)
        + f"\n</si:covarianceMatrix><si:coverageFactor>{k}</si:coverageFactor>"
        "<si:coverageProbability>0.95</si:coverageProbability></si:ellipsoidalRegionXMLList>"
    )
    values = certificate.coordinates.ravel()
    u = certificate.standard_uncertainties.ravel()
    return _list(certificate, coordinate_names(certificate), values, u, region)


def _ellipsoid_factor(certificate: PlateCertificate) -> str:
    """The factor of an ellipsoid of 95 % of the co-ordinates that are uncertain, by chi square or
    by Hotelling's distribution (GUM supplement 2, 6.5).
    """
    from scipy.special import chdtri, fdtri

    rank = int(lstsq(certificate.covariance, certificate.covariance)[2])
    freedom = certificate.degrees_of_freedom
    square = chdtri(rank, 0.05) if np.isinf(freedom) else rank * fdtri(rank, freedom, 0.95)
    return f"{max(float(np.sqrt(square)), 1.0):.6g}"


def _list(
    certificate: PlateCertificate,
    names: list[str],
    values: np.ndarray,
    u: np.ndarray,
    units_text: str,
) -> str:
    k = certificate.coverage_factor
    return (
        f"<si:realListXMLList>\n<si:labelXMLList>{_labels(names)}</si:labelXMLList>\n"
        f"<si:valueXMLList>{' '.join(scaled(value, 3) for value in values.tolist())}"
        f"</si:valueXMLList>\n<si:unitXMLList>{MILLIMETRE}</si:unitXMLList>\n"
        f"<si:expandedUncXMLList><si:uncertaintyXMLList>"
        f"{' '.join(scaled(k * value, 3) for value in u.tolist())}</si:uncertaintyXMLList>"
        f"<si:coverageFactorXMLList>{k:g}</si:coverageFactorXMLList><si:coverageProbabilityXMLList>"
        f"{certificate.coverage_probability:.6f}</si:coverageProbabilityXMLList>"
        f"</si:expandedUncXMLList>\n{units_text}</si:realListXMLList>"
    )


def _distances(certificate: PlateCertificate) -> str:
    finite_distances = [
        distance for distance in certificate.distances if np.isfinite(distance.standard_uncertainty)
    ]
    if not finite_distances:
        return ""
    values = _list(
        certificate,
        [" ".join(distance.balls) for distance in finite_distances],
        np.array([distance.length for distance in finite_distances]),
        np.array([distance.standard_uncertainty for distance in finite_distances]),
        "",
    )
    return (
        f'<dcc:result id="distances">{_name("Distances between balls")}<dcc:description>'
        f"{_content('These follow from the co-ordinates, whose covariance they share.')}"
        f"</dcc:description><dcc:data><dcc:quantity>{values}</dcc:quantity></dcc:data></dcc:result>"
    )
