"""The laws of shear flow on the host and on the device, and laws that the fast model lacks."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import warp as wp

from sealtwin.core.errors import InputError
from simulate.pour import Pour
from simulate.settings import Fluid
from simulate.setup.rheology import Rheology, paste_on_device, viscous_weight
from simulate.shear_law import FLOW_BETWEEN_PLATES, Law
from simulate.slot.run import paste_of
from tests.support.device_loops import weigh
from tests.support.small_fluids import as_paper, path, sample_of, slot

SUPPORT_CM, STEP_S = 0.16, 2e-3


@pytest.mark.parametrize("law", Law)
def test_host_and_device_have_the_same_shear_laws(law: Law):
    """The tolerance is float32's. A new law fails until both have it. Seen to fail without the power n on one side."""
    indices = [0.3, 1.0, 1.7] if law is Law.HERSCHEL_BULKLEY else [1.0]
    fluids = [
        Rheology(weight, 0.0, law=law, flow_index=index, yield_cm2_s2=stress)
        for weight, stress, index in product((0.0, 30.0), (0.0, 70.0), indices)
    ]
    paste = paste_on_device(fluids, SUPPORT_CM, STEP_S, 1, 1e-6, "cpu")
    shear_per_s = np.geomspace(0.01, 100.0, 9)
    weight = wp.zeros((len(fluids), len(shear_per_s)), dtype=float, device="cpu")
    wp.launch(weigh, weight.shape, inputs=[paste, wp.array(shear_per_s, dtype=float), weight], device="cpu")
    wanted = [[fluid.apparent_cm2_s(shear, SUPPORT_CM, STEP_S)[0] for shear in shear_per_s] for fluid in fluids]
    per_viscosity = viscous_weight(1.0, SUPPORT_CM, STEP_S) / (np.sqrt(np.pi) * SUPPORT_CM)
    assert weight.numpy() == pytest.approx(per_viscosity * np.array(wanted), rel=1e-5)


def test_the_fast_model_refuses_a_shear_law_without_a_flow_between_plates(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delitem(FLOW_BETWEEN_PLATES, Law.HERSCHEL_BULKLEY)
    crack = slot(40.0)
    inputs = Pour(sample_of(crack, path(crack[1], 1.2)), (Fluid(viscosity_pa_s=2.0),), as_paper({}))
    paste_of(inputs)
    with pytest.raises(InputError, match=r"fluid\.consistency_pa_s_n selects .*particles"):
        paste_of(replace(inputs, fluids=(Fluid(consistency_pa_s_n=2.0, flow_index=0.5),)))
