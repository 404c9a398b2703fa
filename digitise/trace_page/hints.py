"""What a user says on the trace page: the keys of [photo] that clicks can give."""

from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field

from digitise.settings import MOST_VIA, PhotoInput, Pixel
from sealtwin.settings import Settings
from sealtwin.store.settings_file import checked

UNSCALED_MM_PER_PX = 1.0
"""While nobody has given a scale: a millimetre a pixel, so that what is measured in mm reads in px."""


class Hints(Settings):
    """The part of ``PhotoInput`` that is given by pointing. None: not said. Bounds and sense are checked there."""

    ends_px: tuple[Pixel, Pixel] | None = None
    via_px: tuple[Pixel, ...] | None = Field(default=None, max_length=MOST_VIA)
    roi_px: tuple[Pixel, ...] | None = Field(default=None, max_length=200)
    mm_per_px: float | None = None
    scale_is: Literal["measured", "assumed"] | None = None
    ruler_px: tuple[Pixel, Pixel] | None = None
    ruler_mm: float | None = None
    face_mm: tuple[float, float] | None = None
    face_corners_px: tuple[Pixel, Pixel, Pixel, Pixel] | None = None

    @classmethod
    def of(cls, photo: PhotoInput) -> Self:
        """Those that a trial has already; its defaults are not said."""
        return cls(**{key: getattr(photo, key) for key in cls.model_fields if key in photo.model_fields_set})

    def said(self, keys: frozenset[str] | None = None) -> dict[str, Any]:
        """What was said, of ``keys`` or of all."""
        return self.model_dump(mode="json", exclude_none=True, include=None if keys is None else set(keys))


SCALE_KEYS = frozenset({"mm_per_px", "scale_is", "ruler_px", "ruler_mm", "face_mm", "face_corners_px"})
PATH_KEYS = frozenset(Hints.model_fields) - SCALE_KEYS


def rest_of(photo: PhotoInput) -> dict[str, Any]:
    """What a trial says of its photo beside the hints."""
    return photo.model_dump(mode="json", exclude=set(Hints.model_fields), exclude_none=True)


def scale_settings(rest: dict[str, Any], hints: Hints) -> PhotoInput | None:
    """Settings of the photo with the scale that markers or hints give; None where they give none.

    Raises InputError where they give several, or half of one.
    """
    said = hints.said(SCALE_KEYS)
    if not rest.get("markers") and not said.keys() - {"scale_is"}:
        return None
    return checked(PhotoInput, Path(rest["file"]), {**rest, **said})


def path_settings(rest: dict[str, Any], hints: Hints) -> PhotoInput:
    """Settings of the photo with what the hints say of the crack, whatever the scale. Raises InputError as above."""
    unscaled = {key: value for key, value in rest.items() if key != "markers"} | {"mm_per_px": UNSCALED_MM_PER_PX}
    return checked(PhotoInput, Path(rest["file"]), {**unscaled, **hints.said(PATH_KEYS)})
