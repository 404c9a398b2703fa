"""The text of a material.toml."""

import json

from simulate.material_file import Material

MEASURED = "A paste as it was measured, written by 'sealtwin material'. Errors are standard uncertainties."
CALIBRATED = "A paste as the levels of trials determine it, by 'sealtwin calibrate'. Errors are standard uncertainties."
USE = "In a trial file: [fluid] material = the name of this file; not_for says what these numbers must not be used for."


def material_text(material: Material) -> str:
    """Return a material as TOML."""
    import tomlkit
    from tomlkit.items import Array

    document = tomlkit.document()
    for line in (MEASURED if material.radius_mm is None else CALIBRATED, USE):
        document.add(tomlkit.comment(line))
    for key, value in json.loads(material.model_dump_json(exclude_none=True)).items():
        item = tomlkit.item(value)
        if isinstance(item, Array) and key in ("basis", "not_for"):
            item.multiline(True)
        document.add(key, item)
    return tomlkit.dumps(document)
