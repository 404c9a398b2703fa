"""A corrected plan spills no more than the first, by the fast model; particles stand 0.5 mm lower here."""

from dataclasses import replace

from benchmarks.plan_outside import OWN
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile, Sample
from sealtwin.plan import PlanOptions, make_plan
from sealtwin.plan.verify import Verifier, misfit
from tests.shapes import straight_slot

OUTLINE = straight_slot(60.0, 3.0)
assert OWN.crack is not None
SOLID = build_solid(OUTLINE, OWN.crack)
SAMPLE = Sample(OUTLINE, SOLID, plan_trajectory(OUTLINE, OWN.path, SOLID.cavity_volume_mm3, SOLID.sections))


def filled(path, more=1.0):
    path = plan_trajectory(OUTLINE, path, SOLID.cavity_volume_mm3, SOLID.sections)
    bed = make_plan.case_of(SAMPLE, OWN).fill(replace(path, flow_mm3_s=more * path.flow_mm3_s))
    return Profile(bed.sections.s_mm, bed.level_mm)


class Lower(Verifier):
    def levels(self, title, paths, *, drafts=False):
        return [replace(bed, level_mm=bed.level_mm - 0.5) for bed in (filled(path) for _, path, _ in paths)]


verifier = Lower(OWN.shown_by.file, OWN, SAMPLE, "cpu", Progress())
first, *_, last = make_plan.plan_on(verifier, PlanOptions(verify=2, seeds=1, accurate=True), []).rounds
before, after = (misfit(SAMPLE, filled(plan.path, 1.1)).over_mm3 for plan in (first, last))
figures = f"{after:.0f} mm3 over the face with 10 % more flow, {before:.0f} before the correction"
print("right:" if after <= 1.001 * before else "silent:", figures)
