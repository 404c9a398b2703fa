"""Records of two cracks in one call of the Python interface, as in a notebook whose cells were run out of order."""

import warnings

import sealtwin as st

warnings.simplefilter("ignore")
line_mm, paste = [(0, 0), (20, 3), (45, -2), (80, 5)], st.Fluid(viscosity_pa_s=0.3, yield_stress_pa=3)
crack, other = st.crack_from_polyline(line_mm, 3.0), st.crack_from_polyline([(0, 0), (60, 0)], 2.0)
solid = st.build_solid(crack, 16, tilt="vertical")
path = st.plan_path(st.crack_from_polyline(line_mm, 3.0), solid, volume_ml=3)  # Equal, as of a cell that is run again
level = st.fill_fast(crack, solid, path, paste)
readings, silent, sentence = st.read_readings([(5, -4), (20, -4), (35, -4), (55, -4)], other), [], ""
for call, *given in [
    (st.fill_fast, other, solid, path, paste),
    (st.plan_path, other, solid),
    (st.compare, level, readings, other, solid),
    (st.write_robot_program, "robot", other, path, "cell.toml"),
]:
    try:
        call(*given)
        silent.append(call.__name__)
    except st.InputError as fault:
        sentence = str(fault)
        silent += [] if "length 60.0 mm" in sentence else [call.__name__]
print(f"silent: {', '.join(silent)}" if silent else f"said: {sentence}")
