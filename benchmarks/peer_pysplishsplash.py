# pyright: basic, reportMissingImports=false
"""SPlisHSPlasH on the case of ``benchmarks.peers``, which starts this: walls by Akinci, viscosity by Weiler.

It is unstable in millimetres: lengths are 62.5 times as large, times 62.5^0.5 and viscosities 62.5^1.5 times, with the
same gravity, so that Froude and Reynolds numbers stay. Walls are particles on a surface half a spacing beyond the slot.
"""

import contextlib
import ctypes
import json
import sys
import time
from pathlib import Path

# The wheel brings some of OpenGL's libraries; unless the system's come first, both are loaded, and crash.
with contextlib.suppress(OSError):
    ctypes.CDLL("libGL.so.1")
import pysplishsplash as sph

SCALE = 62.5
case = json.load(sys.stdin)
mm, s = SCALE / 1e3, SCALE**0.5
viscosity = case["viscosity_mm2_s"] * 1e-6 * SCALE**1.5
sizes, grow = case["pit_mm"], 2 * case["radius_mm"]
lines = [" ".join(f"{mm * x:.6f}" for x in place) + " 0 0 0" for place in case["place_mm"]]
head = ["ATTRIBUTES", "position velocity", "TYPES", "V V", f"NUMBER_OF_PARTICLES: {len(lines)}", "BEGIN DATA"]
block = Path("block.pda").resolve()
block.write_text("\n".join([*head, *lines, ""]))
step = case["step_s"] * s
scene = {
    "Configuration": {
        "timeStepSize": step,
        "particleRadius": case["radius_mm"] * mm,
        "simulationMethod": {"PBF": 2, "DFSPH": 4}[case["method"]],
        "gravitation": [0, 0, -case["gravity_mm_s2"] / 1e3],
        "cflMethod": 0,
        "boundaryHandlingMethod": 0,
        "DFSPH": {"maxError": 0.1, "maxErrorV": 0.1},  # Percent: 2.5 times as fast as by default, and no worse
        "PBF": {"minIterations": 5, "maxIterations": 5},
    },
    "Materials": [
        {
            "id": "Fluid",
            "density0": case["density_kg_m3"],
            "viscosityMethod": 6,
            "Weiler et al. 2018": {"viscosity": viscosity, "viscosityBoundary": viscosity * case["wall_share"]},
        }
    ],
    "RigidBodies": [
        {
            "geometryFile": str(Path(sys.prefix) / "bin/data/models/UnitBox.obj"),
            "translation": [mm * sizes[0] / 2, 0, mm * sizes[2] / 2],
            "scale": [mm * (size + grow) for size in sizes],
            "isDynamic": False,
            "isWall": True,
            "mapInvert": True,
            "samplingMode": 1,
        }
    ],
    "FluidModels": [{"particleFile": str(block), "id": "Fluid"}],
}
block.with_name("scene.json").write_text(json.dumps(scene))
base, last_s = sph.Exec.SimulatorBase(), case["times_s"][-1]
options = {"useCache": False, "outputDir": str(block.with_name("out")), "initialPause": False, "useGui": False}
base.init(sceneFile=str(block.with_name("scene.json")), stopAt=(last_s + 2 * case["step_s"]) * s, **options)
base.initSimulation()
fluid, clock = sph.Simulation.getCurrent().getFluidModel(0), sph.TimeManager.getCurrent()
moments, marks, began_s = [], [], time.process_time()


def note():
    if len(moments) < len(case["times_s"]) and clock.getTime() > case["times_s"][len(moments)] * s - step / 2:
        marks.append(time.process_time())
        moments.append([(fluid.getPosition(i) / mm).tolist() for i in range(fluid.numActiveParticles())])


base.setTimeStepCB(note)
base.runSimulation()
Path(sys.argv[1]).write_text(json.dumps({"place_mm": moments, "set_up_s": began_s, "time_s": marks[-1] - began_s}))
