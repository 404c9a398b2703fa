"""What a note can say: the settings of a trial, and three words of its own."""

from functools import cache

from sealtwin.settings import Settings
from sealtwin.trials.trial import Trial

NAME = "name"
DATA, DATE, OPERATOR = "data", "date", "operator"
OWN = frozenset({DATA, DATE, OPERATOR})
"""data: where photo and readings come from, both at once. Date and operator go into the catalogue."""
OF_READINGS = ("readings.", "gate.")
"""How keys begin that say nothing of a sample without readings."""
MESH = "mesh"
"""A lab's samples are photos; 'sealtwin import-mesh' takes a mesh."""
ALTERNATIVES = (
    (
        {"photo.mm_per_px", "photo.scale_is"},
        {"photo.ruler_px", "photo.ruler_mm"},
        {"photo.markers", "photo.face_mm", "photo.face_corners_px"},
    ),
    ({"fluid.U", "fluid.D_cm"}, {"fluid.viscosity_pa_s"}),
)
"""Ways to say one thing: a sample's own takes the place of the folder's, whichever that is."""


@cache
def known_keys() -> frozenset[str]:
    """Dotted names of all settings that a note may give."""
    keys = set(OWN)
    for name, field in Trial.model_fields.items():
        table = settings_in(field.annotation)
        if table is None:
            keys.add(name)
        elif name != MESH:
            keys |= {f"{name}.{key}" for key in table.model_fields}
    return frozenset(keys)


def tables() -> frozenset[str]:
    return frozenset(key.partition(".")[0] for key in known_keys() if "." in key)


def settings_in(annotation: object) -> type[Settings] | None:
    """The settings class inside X or X | None."""
    for inner in (annotation, *getattr(annotation, "__args__", ())):
        if isinstance(inner, type) and issubclass(inner, Settings):
            return inner
    return None
