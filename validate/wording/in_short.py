"""The answer in a few sentences, for a reader who knows neither the method nor its words."""

from validate.report_input import Evidence
from validate.uncertainty.earlier_trials import expected_sentences
from validate.wording.comparison import volumes_mm3

ML = 1000.0  # mm³


def in_short(evidence: Evidence) -> tuple[str, ...]:
    """Return how near the level comes to the readings, if any, where the sealant went, what earlier trials say."""
    expected = () if evidence.earlier is None else expected_sentences(evidence.earlier)
    return (*_nearness(evidence), _whereabouts(evidence), *expected)


def _nearness(evidence: Evidence) -> tuple[str, ...]:
    if evidence.comparison is None:
        return ()
    m = evidence.comparison
    side = "above" if m.bias_mm > 0 else "below"
    off = f"{m.worst_error_mm:.1f} mm at most, {m.worst_at_mm:.0f} mm from the start"
    if (station := m.worst_at_a_station) is not None:
        off = f"{station.error_mm:.1f} mm at most at a station, {station.s_mm:.0f} mm from the start"
    lies = f"{abs(m.bias_mm):.1f} mm {side}" if round(m.bias_mm, 1) else "as high as"
    return (
        f"Along {m.covered_length_mm:.0f} mm of crack, the computed sealant surface is {m.mean_error_mm:.1f} mm off "
        f"the readings on average and {off}; its mean level lies {lies} theirs.",
    )


def _whereabouts(evidence: Evidence) -> str:
    ml = {place: volume_mm3 / ML for place, (_, volume_mm3) in volumes_mm3(evidence).items()}
    if not evidence.run.has_particles:
        return (
            f"Of {ml['dispensed']:.2f} ml dispensed, {ml['in_crack']:.2f} ml lie in the crack, whose room below the "
            f"face is {evidence.solid.cavity_volume_mm3 / ML:.2f} ml, and {ml['above_face']:.2f} ml above the face, by "
            "the fast model; what runs over the edge of the sample it does not compute."
        )
    amount = f"{ml['spilled']:.2f} ml" if ml["spilled"] >= 0.005 else "less than 0.01 ml"
    over = f"{amount if ml['spilled'] else 'none'} ran over the edge of the sample"
    return (
        f"Of {ml['dispensed']:.2f} ml dispensed, {ml['in_crack']:.2f} ml lie in the crack, whose room below the face "
        f"is {evidence.solid.cavity_volume_mm3 / ML:.2f} ml, and {ml['above_face']:.2f} ml above the face; {over}."
    )
