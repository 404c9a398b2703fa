"""Where the dispensed sealant is."""

from validate.evidence import Evidence
from validate.statements.table import Table
from validate.wording import counted


def balance_table(evidence: Evidence) -> Table:
    run = evidence.run
    rows = [
        (label, f"{volume_mm3:.0f} mm³, {counted(round(volume_mm3 / run.particle_volume_mm3), 'particle')}")
        for label, volume_mm3 in volumes_mm3(evidence).values()
    ]
    rows.append(("volume that the settled particles fill, over dispensed", f"{evidence.volume_ratio:.3f}"))
    return Table("Where the sealant is", tuple(rows))


def volumes_mm3(evidence: Evidence) -> dict[str, tuple[str, float]]:
    """Where what was dispensed has gone, by key: in words, and its volume."""
    run = evidence.run
    height_mm = run.position_mm[~run.spilled, 2]
    counts = {
        "dispensed": ("dispensed", len(run.position_mm)),
        "in_crack": ("in the crack, below the face", int((height_mm <= 0).sum())),
        "above_face": ("above the face, the jet under the nozzle included", int((height_mm > 0).sum())),
        "spilled": ("spilled over the sample's edge", run.spilled_particles),
        "escaped": ("escaped through a wall (must be 0)", run.escaped_particles),
    }
    return {key: (label, count * run.particle_volume_mm3) for key, (label, count) in counts.items()}
