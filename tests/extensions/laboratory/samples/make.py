"""Write the samples anew: python -m tests.extensions.laboratory.samples.make

All of them state the readings that campaign.yaml simulates, each as far as its digits go; index.csv
says which, and README.md where the formats were looked up. The tests read what is written here and
do not run it.
"""

from __future__ import annotations

from tests.extensions.laboratory.samples import dmis, programs, tables
from tests.extensions.laboratory.samples.readings import (
    FOLDER,
    INCH,
    MILLIMETRE,
    plain,
    simulate,
)


def main() -> None:
    """Write the samples and the plain CSVs that they have to agree with."""
    readings = simulate()
    files: dict[str, str] = {
        "dmis_mm.dmo": dmis.dmis_millimetres(readings),
        "dmis_inch.dmo": dmis.dmis_inches(readings),
        "dmis_points.dmo": dmis.dmis_surface_points(readings),
        "pcdmis_mm.txt": programs.pcdmis_millimetres(readings),
        "pcdmis_inch.txt": programs.pcdmis_inches(readings),
        "qif_3_0.qif": programs.qif(readings, "3.0.0"),
        "qif_2_1_inch.qif": programs.qif(readings, "2.1.0"),
        "german.csv": tables.german(readings),
        "centres.csv": tables.centres(readings),
        "part.csv": tables.part(readings),
        "inches.csv": tables.inches(readings),
        "missing.csv": tables.missing(readings),
        "swapped.csv": tables.swapped(readings),
        "shuffled.csv": tables.shuffled(readings),
        "wide.csv": tables.wide(readings),
    }
    for end, text in programs.calypso(readings).items():
        files[f"calypso_{end}.txt"] = text
    for name, text in tables.one_per_position(readings).items():
        files[f"one_per_position/{name}.txt"] = text
    for digits in (4, 5, 6, 7):
        files[f"plain/mm{digits}.csv"] = plain(readings, MILLIMETRE, digits, centres=False)
    for digits in (5, 7, 9):
        files[f"plain/centres_inch{digits}.csv"] = plain(readings, INCH, digits, centres=True)
    files["plain/inch6.csv"] = plain(readings, INCH, 6, centres=False)
    absent = tables.LEFT_OUT | tables.EMPTY
    present = [reading for reading in readings if reading.key not in absent]
    files["plain/mm5_missing.csv"] = plain(present, MILLIMETRE, 5, centres=False)
    for name, text in files.items():
        path = FOLDER / name
        path.parent.mkdir(exist_ok=True)
        german = name.startswith(("calypso", "german"))
        path.write_bytes(text.encode("cp1252" if german else "utf-8"))


if __name__ == "__main__":
    main()
