"""Digital calibration certificates written out as text, in the spellings that the schemas have."""

from __future__ import annotations

from collections.abc import Sequence

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<dcc:digitalCalibrationCertificate xmlns:dcc="https://ptb.de/dcc" xmlns:si="https://ptb.de/si"
  schemaVersion="{version}">
"""
ADMINISTRATIVE = """<dcc:administrativeData>
  <dcc:dccSoftware><dcc:software>
    <dcc:name><dcc:content>by hand</dcc:content></dcc:name><dcc:release>1</dcc:release>
  </dcc:software></dcc:dccSoftware>
  <dcc:coreData>
    <dcc:countryCodeISO3166_1>DE</dcc:countryCodeISO3166_1>
    <dcc:usedLangCodeISO639_1>en</dcc:usedLangCodeISO639_1>
    <dcc:mandatoryLangCodeISO639_1>en</dcc:mandatoryLangCodeISO639_1>
    <dcc:uniqueIdentifier>plate-7</dcc:uniqueIdentifier>
    <dcc:beginPerformanceDate>2026-11-02</dcc:beginPerformanceDate>
    <dcc:endPerformanceDate>2026-11-03</dcc:endPerformanceDate>
    <dcc:performanceLocation>laboratory</dcc:performanceLocation>
  </dcc:coreData>
  <dcc:items><dcc:item>
    <dcc:name><dcc:content lang="en">ball plate</dcc:content></dcc:name>
    <dcc:manufacturer><dcc:name><dcc:content>nobody</dcc:content></dcc:name></dcc:manufacturer>
    <dcc:identifications><dcc:identification>
      <dcc:issuer>owner</dcc:issuer><dcc:value>7</dcc:value>
    </dcc:identification></dcc:identifications>
  </dcc:item></dcc:items>
  <dcc:calibrationLaboratory><dcc:contact>
    <dcc:name><dcc:content>a laboratory</dcc:content></dcc:name>
    <dcc:eMail>nobody@example.org</dcc:eMail>
    <dcc:location><dcc:city>somewhere</dcc:city></dcc:location>
  </dcc:contact></dcc:calibrationLaboratory>
  <dcc:respPersons><dcc:respPerson><dcc:person>
    <dcc:name><dcc:content>somebody</dcc:content></dcc:name>
  </dcc:person></dcc:respPerson></dcc:respPersons>
  <dcc:customer>
    <dcc:name><dcc:content>a customer</dcc:content></dcc:name>
    <dcc:eMail>nobody@example.org</dcc:eMail>
    <dcc:location><dcc:city>somewhere</dcc:city></dcc:location>
  </dcc:customer>
</dcc:administrativeData>
"""


def named(text: str) -> str:
    return f'<dcc:name><dcc:content lang="en">{text}</dcc:content></dcc:name>'


def quantity(content: str, name: str = "") -> str:
    return f"<dcc:quantity>{named(name) if name else ''}{content}</dcc:quantity>"


def result(data: str, name: str = "Lengths", identifier: str = "", kinds: str = "") -> str:
    attributes = f' id="{identifier}"' if identifier else ""
    attributes += f' refType="{kinds}"' if kinds else ""
    return f"<dcc:result{attributes}>{named(name)}<dcc:data>{data}</dcc:data></dcc:result>\n"


def certificate(results: str, version: str = "3.1.2", temperature: str = "20.02") -> str:
    condition = quantity(real("", temperature, "\\degreeCelsius"))
    return (
        HEAD.format(version=version)
        + ADMINISTRATIVE
        + "<dcc:measurementResults><dcc:measurementResult>"
        + named("Ball plate 7")
        + "<dcc:influenceConditions><dcc:influenceCondition>"
        + named("temperature")
        + f"<dcc:data>{condition}</dcc:data></dcc:influenceCondition></dcc:influenceConditions>\n"
        + f"<dcc:results>{results}</dcc:results></dcc:measurementResult></dcc:measurementResults>\n"
        + "</dcc:digitalCalibrationCertificate>\n"
    )


def label(text: str) -> str:
    return f"<si:label>{text}</si:label>" if text else ""


def real(name: str, value: str, unit: str, uncertainty: str = "") -> str:
    return (
        f"<si:real>{label(name)}<si:value>{value}</si:value><si:unit>{unit}</si:unit>"
        f"{uncertainty}</si:real>\n"
    )


def real_in_list(name: str, value: str, uncertainty: str = "") -> str:
    return f"<si:real>{label(name)}<si:value>{value}</si:value>{uncertainty}</si:real>\n"


def expanded(amount: str, k: str = "2") -> str:
    """As in D-SI 1 and 2."""
    factor = f"<si:coverageFactor>{k}</si:coverageFactor>" if k else ""
    return (
        f"<si:expandedUnc><si:uncertainty>{amount}</si:uncertainty>{factor}"
        "<si:coverageProbability>0.95</si:coverageProbability></si:expandedUnc>"
    )


def expanded_later(amount: str, k: str = "2") -> str:
    """As in D-SI 2.2."""
    return (
        "<si:measurementUncertaintyUnivariate><si:expandedMU>"
        f"<si:valueExpandedMU>{amount}</si:valueExpandedMU>"
        f"<si:coverageFactor>{k}</si:coverageFactor>"
        "<si:coverageProbability>0.95</si:coverageProbability>"
        "</si:expandedMU></si:measurementUncertaintyUnivariate>"
    )


def standard_later(amount: str) -> str:
    return (
        "<si:measurementUncertaintyUnivariate><si:standardMU>"
        f"<si:valueStandardMU>{amount}</si:valueStandardMU>"
        "</si:standardMU></si:measurementUncertaintyUnivariate>"
    )


def interval(value: str, amount: str) -> str:
    low, high = float(value) - 2 * float(amount), float(value) + 2 * float(amount)
    return (
        f"<si:coverageInterval><si:standardUnc>{amount}</si:standardUnc>"
        f"<si:intervalMin>{low:.6f}</si:intervalMin><si:intervalMax>{high:.6f}</si:intervalMax>"
        "<si:coverageProbability>0.95</si:coverageProbability></si:coverageInterval>"
    )


def region(matrix: Sequence[Sequence[str]], unit: str, name: str = "ellipsoidalRegion") -> str:
    columns = "".join(
        "<si:column>"
        + "".join(
            f"<si:covariance><si:value>{value}</si:value><si:unit>{unit}</si:unit></si:covariance>"
            for value in column
        )
        + "</si:column>\n"
        for column in zip(*matrix, strict=True)
    )
    return (
        f"<si:{name}><si:covarianceMatrix>{columns}</si:covarianceMatrix>"
        "<si:coverageFactor>2.45</si:coverageFactor>"
        f"<si:coverageProbability>0.95</si:coverageProbability></si:{name}>"
    )


def region_later(matrix: Sequence[Sequence[str]], unit: str) -> str:
    columns = "".join(
        "<si:columnXMLList><si:covarianceXMLList>"
        f"<si:valueXMLList>{' '.join(column)}</si:valueXMLList>"
        f"<si:unitXMLList>{unit}</si:unitXMLList></si:covarianceXMLList></si:columnXMLList>\n"
        for column in zip(*matrix, strict=True)
    )
    return (
        "<si:measurementUncertaintyMultivariateXMLList><si:ellipsoidalRegionMUXMLList>"
        f"<si:covarianceMatrixXMLList>{columns}</si:covarianceMatrixXMLList>"
        "<si:coverageFactorXMLList>2.45</si:coverageFactorXMLList>"
        "<si:coverageProbabilityXMLList>0.95</si:coverageProbabilityXMLList>"
        "</si:ellipsoidalRegionMUXMLList></si:measurementUncertaintyMultivariateXMLList>"
    )


def listed(content: str, unit: str = "", uncertainty: str = "", covariance: str = "") -> str:
    """A `si:realList` in a `si:list`."""
    common = f"<si:listUnit>{unit}</si:listUnit>" if unit else ""
    if uncertainty:
        common += f"<si:listUnivariateUnc>{uncertainty}</si:listUnivariateUnc>"
    return f"<si:list><si:realList>{common}{content}{covariance}</si:realList></si:list>"


def spaced(
    labels: Sequence[str], values: Sequence[str], unit: str, amounts: Sequence[str], rest: str = ""
) -> str:
    """A `si:realListXMLList` with expanded uncertainties, or none."""
    stated = ""
    if amounts:
        stated = (
            f"<si:expandedUncXMLList><si:uncertaintyXMLList>{' '.join(amounts)}"
            "</si:uncertaintyXMLList><si:coverageFactorXMLList>2</si:coverageFactorXMLList>"
            "<si:coverageProbabilityXMLList>0.95</si:coverageProbabilityXMLList>"
            "</si:expandedUncXMLList>"
        )
    names = f"<si:labelXMLList>{' '.join(labels)}</si:labelXMLList>" if labels else ""
    return (
        f"<si:realListXMLList>{names}<si:valueXMLList>{' '.join(values)}</si:valueXMLList>"
        f"<si:unitXMLList>{unit}</si:unitXMLList>{stated}{rest}</si:realListXMLList>"
    )


def spaced_later(
    labels: Sequence[str], values: Sequence[str], unit: str, amounts: Sequence[str]
) -> str:
    """The same with the uncertainties of D-SI 2.2."""
    return (
        f"<si:realListXMLList><si:labelXMLList>{' '.join(labels)}</si:labelXMLList>"
        f"<si:valueXMLList>{' '.join(values)}</si:valueXMLList>"
        f"<si:unitXMLList>{unit}</si:unitXMLList>"
        "<si:measurementUncertaintyUnivariateXMLList><si:expandedMUXMLList>"
        f"<si:valueExpandedMUXMLList>{' '.join(amounts)}</si:valueExpandedMUXMLList>"
        "<si:coverageFactorXMLList>2</si:coverageFactorXMLList>"
        "<si:coverageProbabilityXMLList>0.95</si:coverageProbabilityXMLList>"
        "</si:expandedMUXMLList></si:measurementUncertaintyUnivariateXMLList></si:realListXMLList>"
    )
