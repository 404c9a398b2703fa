// The fast model of simulate/slot/ for the report's page. Names and order are those of its Python modules, which
// give the reasons; tests/browser/test_live_report.py compares both levels. Arrays have a value for each cell of the crack.
const slot = (() => {
  const sum = (values) => values.reduce((total, value) => total + value, 0);
  const mean = (values) => sum(values) / values.length;
  const clip = (value, low, high) => Math.min(Math.max(value, low), high);
  const zip = (count, value) => Float64Array.from({ length: count }, (_, i) => value(i));

  // numpy.interp: linear between, constant beyond.
  const interp = (at, known, values) => {
    let [low, high] = [0, known.length - 1];
    if (!(at > known[0])) return values[0];
    if (at >= known[high]) return values[high];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (known[middle] <= at) low = middle;
      else high = middle;
    }
    return values[low] + ((values[high] - values[low]) * (at - known[low])) / (known[high] - known[low]);
  };

  // simulate/slot/sections.py

  const [NARROWEST_MM, ROUND_CORNERS, INVERTED, ROUNDING_MM] = [0.05, 4 - Math.PI, 20, 1e-9];

  class Trapezoids {
    constructor(sections, reach_per_mm) {
      Object.assign(this, { reach_per_mm, reach_mm: sections.reach_mm });
      for (const name of ["s_mm", "floor_mm", "mouth_mm", "depth_mm", "slant"]) this[name] = Float64Array.from(sections[name]);
      this.step_mm = this.s_mm[1] - this.s_mm[0];
      const count = this.s_mm.length;
      this.opening = zip(count, (i) => (this.mouth_mm[i] - this.floor_mm[i]) / this.depth_mm[i]);
      this.full_mm2 = zip(count, (i) => ((this.floor_mm[i] + this.mouth_mm[i]) / 2) * this.depth_mm[i]);
    }

    // Area of section i filled to a height, and the width there.
    area_mm2(i, height_mm) {
      const inside_mm = clip(height_mm, 0, this.depth_mm[i]);
      const width_mm = this.floor_mm[i] + this.opening[i] * inside_mm;
      const over_mm = Math.max(height_mm - this.depth_mm[i], 0);
      const [beside_mm2, grows_mm] = this.slump(over_mm);
      const below_mm2 = Math.min(height_mm, 0) * this.floor_mm[i];
      const area_mm2 = ((this.floor_mm[i] + width_mm) / 2) * inside_mm + below_mm2;
      return [area_mm2 + this.mouth_mm[i] * over_mm + beside_mm2, width_mm + grows_mm];
    }

    slump(over_mm) {
      const free_mm = this.reach_per_mm * over_mm ** 2;
      if (free_mm <= this.reach_mm) return [(4 / 3) * free_mm * over_mm, 4 * free_mm];
      const edge_mm = Math.sqrt(this.reach_mm / this.reach_per_mm);
      return [(4 / 3) * this.reach_per_mm * edge_mm ** 3 + 2 * this.reach_mm * (over_mm - edge_mm), 2 * this.reach_mm];
    }

    height_mm(i, area_mm2) {
      const [floor_mm, full_mm2] = [this.floor_mm[i], this.full_mm2[i]];
      if (area_mm2 <= full_mm2) {
        const inside_mm2 = Math.max(area_mm2, 0);
        const root_mm = Math.sqrt(Math.max(floor_mm ** 2 + 2 * this.opening[i] * inside_mm2, 0));
        return (2 * inside_mm2) / (floor_mm + root_mm) + Math.min(area_mm2, 0) / floor_mm;
      }
      let height_mm = this.depth_mm[i] + (area_mm2 - full_mm2) / this.mouth_mm[i];
      for (let step = 0; step < INVERTED; step += 1) {
        const [there_mm2, width_mm] = this.area_mm2(i, height_mm);
        const change_mm = (there_mm2 - area_mm2) / width_mm;
        height_mm -= change_mm;
        if (Math.abs(change_mm) < ROUNDING_MM) break;
      }
      return height_mm;
    }

    wetted_mm(i, height_mm) {
      return this.floor_mm[i] + this.slant[i] * clip(height_mm, 0, this.depth_mm[i]);
    }

    slenderness(area_mm2, height_mm) {
      const high_mm = 2 * Math.max(height_mm, NARROWEST_MM);
      const wide_mm = Math.max((2 * area_mm2) / high_mm, NARROWEST_MM);
      return Math.min(wide_mm / high_mm, high_mm / wide_mm);
    }

    holding_mm(area_mm2, wetted_mm) {
      const half_mm = Math.sqrt(Math.max(wetted_mm ** 2 - 2 * ROUND_CORNERS * area_mm2, 0));
      return (2 * area_mm2) / (wetted_mm + half_mm);
    }
  }

  // simulate/slot/flux.py

  const DUCT = [1.0, -1.3553, 1.9467, -1.7012, 0.9564, -0.2537];
  const GRAVITY_M_S2 = 9.81;
  const weight_pa_mm = (paste) => 1e-3 * paste.density_kg_m3 * GRAVITY_M_S2;
  const rounder = (side_by_side) => 1 / DUCT.reduceRight((total, term) => total * side_by_side + term, 0);

  // Area of section i, push at which its paste yields, and rate.
  const conduit = (paste, sections, i, area_mm2, height_mm) => {
    const wetted_mm = sections.wetted_mm(i, height_mm);
    const deep_pa = weight_pa_mm(paste) * Math.max(height_mm, 0);
    const pressure_pa = (deep_pa * (1 + sections.floor_mm[i] / wetted_mm)) / 2;
    const holds_pa = paste.wall_share * paste.yield_stress_pa + paste.friction * pressure_pa;
    const threshold = area_mm2 > 0 ? holds_pa / sections.holding_mm(area_mm2, wetted_mm) : Infinity;
    const m = 1 / paste.flow_index;
    const radius_mm = (area_mm2 / wetted_mm) * Math.sqrt(rounder(sections.slenderness(area_mm2, height_mm)));
    const thick = paste.wall_share * paste.consistency_pa_s_n;
    return { area_mm2, threshold, rate: radius_mm ** (m + 1) / (m + 2) / thick ** m };
  };

  // Flow along a push, and its growth with it.
  const flow_mm3_s = ({ area_mm2, threshold, rate }, push, m) => {
    const size = Math.abs(push);
    if (!(size > threshold)) return [0, 0];
    const plug = threshold / size;
    const sheared = m === 1 ? 1 - plug : (1 - plug) ** m; // A power takes longer than the rest
    const shape = 1 + plug / (m + 1);
    const free = area_mm2 * rate * (m === 1 ? 1 : size ** (m - 1));
    const share = sheared * (1 - plug) * shape;
    const steeper = plug * sheared * ((m + 1) * shape - (1 - plug) / (m + 1));
    return [Math.sign(push) * free * size * share, free * (m * share + steeper)];
  };

  // simulate/slot/supply.py

  const [GRAVITY_MM_S2, SAMPLES] = [9810, 8];

  // Share of a disc of radius 1 below a place.
  const below = (place) => {
    if (place <= -1) return 0;
    if (place >= 1) return 1;
    return 0.5 + (Math.asin(place) + place * Math.sqrt(1 - place ** 2)) / Math.PI;
  };

  // Volume that lands in each cell, by step.
  const supplied_mm3 = (path, times_s, edges_mm, nozzle_mm, surface_mm, [along, into]) => {
    const end_s = path.t_s.at(-1);
    const moments = SAMPLES * times_s.length;
    const cells = edges_mm.length - 1;
    const landed_mm3 = times_s.slice(1).map(() => new Float64Array(cells));
    for (let moment = 0; moment < moments; moment += 1) {
      const [before_s, after_s] = [(end_s * moment) / moments, (end_s * (moment + 1)) / moments];
      const middle_s = (before_s + after_s) / 2;
      const volume_mm3 = interp(after_s, path.t_s, path.given_mm3) - interp(before_s, path.t_s, path.given_mm3);
      const speed_mm_s = volume_mm3 / (after_s - before_s) / ((Math.PI / 4) * nozzle_mm ** 2);
      const height_mm = Math.max(interp(middle_s, path.t_s, path.z_mm) - surface_mm, 0);
      const pull_mm_s2 = GRAVITY_MM_S2 * into;
      const falls_s = (Math.sqrt(speed_mm_s ** 2 + 2 * pull_mm_s2 * height_mm) - speed_mm_s) / pull_mm_s2;
      const lands_mm = interp(middle_s, path.t_s, path.s_mm) + (GRAVITY_MM_S2 * along * falls_s ** 2) / 2;
      const step = times_s.findLastIndex((t_s) => t_s < middle_s + falls_s);
      if (step >= landed_mm3.length) continue;
      let before = 0;
      for (let i = 0; i < cells; i += 1) {
        const share = i === cells - 1 ? 1 : below((2 * (edges_mm[i + 1] - lands_mm)) / nozzle_mm);
        landed_mm3[step][i] += volume_mm3 * (share - before);
        before = share;
      }
    }
    return landed_mm3;
  };

  // simulate/slot/mound.py

  const [MOUND, CROWN, MOST] = [4.0, 2.0, 0.5];

  // Area in each section of the mound under the nozzle's last place.
  const mound_mm2 = (sections, landed_mm3, held_mm, middle_mm, nozzle_mm, surface_mm) => {
    const area_mm2 = sections.s_mm.map((s_mm, i) => {
      const aside_mm = Math.max(Math.abs(s_mm - middle_mm) - nozzle_mm / 2, 0);
      const rise_mm = Math.sqrt(Math.max((MOUND * held_mm) ** 2 - 2 * held_mm * aside_mm, 0));
      return rise_mm * sections.area_mm2(i, surface_mm + sections.depth_mm[i])[1];
    });
    const total_mm3 = sum(area_mm2) * sections.step_mm;
    const share = total_mm3 > 0 ? Math.min(1, (MOST * landed_mm3) / total_mm3) : 0;
    return area_mm2.map((one_mm2) => one_mm2 * share);
  };

  // Height of the middle of the crack over the mean across it.
  const crown_mm = (height_mm, depth_mm, held_mm) =>
    clip(Math.min(height_mm, depth_mm - height_mm), 0, (CROWN * held_mm) / 3);

  // simulate/slot/fill.py

  const [STEPS, GROWS, TOLERANCE, MOST_NEWTON, MOST_HALVED, OVERSHOT, HUGE] = [200, 1.05, 1e-6, 60, 12, 0.3, 1e6];

  // Returns sections, area and level of each cell, and the dispensed volume. The nozzle dispenses along ``path`` from
  // t_s = 0 to its last and then moves for ``after_s``; gravity pulls ``along`` the crack at the faces between cells.
  const fill = (shape, path, paste, { nozzle_mm, settle_s, along, into }) => {
    const weight = weight_pa_mm(paste);
    const reach = paste.yield_stress_pa > 0 ? Math.min(HUGE, weight / (2 * paste.yield_stress_pa)) : HUGE;
    const sections = new Trapezoids(shape, reach);
    const times = times_s(path, settle_s);
    const cells = sections.s_mm.length;
    const edges_mm = zip(cells + 1, (i) => i * sections.step_mm);
    const dispensed_mm3 = path.given_mm3.at(-1);
    const flat = Math.min(1, dispensed_mm3 / sum(sections.full_mm2) / sections.step_mm);
    const surface_mm = -mean(sections.depth_mm) * (1 - flat);
    const landed_mm3 = supplied_mm3(path, times, edges_mm, nozzle_mm, surface_mm, [mean(along), into]);
    const held_mm = paste.yield_stress_pa / (weight * into);
    const all_mm3 = sum(landed_mm3.map(sum));
    const mound = mound_mm2(sections, all_mm3, held_mm, path.s_mm.at(-1), nozzle_mm, surface_mm);
    const flowing = 1 - (sum(mound) * sections.step_mm) / Math.max(all_mm3, Number.MIN_VALUE);
    const bed = new Bed(sections, paste, weight * into, along.map((pull) => weight * pull));
    landed_mm3.forEach((landed, step) => {
      bed.advance(times[step + 1] - times[step], landed.map((volume_mm3) => (flowing * volume_mm3) / sections.step_mm));
    });
    const area_mm2 = bed.area_mm2.map((one_mm2, i) => one_mm2 + mound[i]);
    const level_mm = area_mm2.map((one_mm2, i) => {
      const height_mm = sections.height_mm(i, one_mm2);
      return height_mm - sections.depth_mm[i] + crown_mm(height_mm, sections.depth_mm[i], held_mm);
    });
    return { sections, area_mm2, level_mm, dispensed_mm3 };
  };

  // Ends of the steps.
  const times_s = (path, settle_s) => {
    const end_s = path.t_s.at(-1);
    const times = [...zip(STEPS + 1, (step) => (end_s * step) / STEPS)];
    const rest_s = path.after_s + settle_s;
    if (rest_s <= 0) return times;
    const count = Math.ceil(Math.log1p((rest_s / times[1]) * (GROWS - 1)) / Math.log(GROWS));
    let after_s = 0;
    const later = [...zip(count, (step) => (after_s += GROWS ** step))];
    return [...times, ...later.map((one_s) => end_s + (one_s / after_s) * rest_s)];
  };

  class Bed {
    constructor(sections, paste, weight, pull) {
      Object.assign(this, { sections, paste, weight, pull, m: 1 / paste.flow_index });
      this.tolerance_mm2 = TOLERANCE * Math.max(...sections.full_mm2);
      this.area_mm2 = new Float64Array(sections.s_mm.length);
      this.height_mm = new Float64Array(sections.s_mm.length);
    }

    advance(step_s, landed_mm2) {
      const { sections } = this;
      const share = step_s / sections.step_mm;
      let height_mm = this.height_mm;
      this.area_mm2 = this.area_mm2.map((area_mm2, i) => area_mm2 + landed_mm2[i]);
      const through = this.faces(this.area_mm2.map((area_mm2, i) => sections.height_mm(i, area_mm2)));
      let now = this.state(through, height_mm, share);
      for (let newton = 0; newton < MOST_NEWTON; newton += 1) {
        if (now.residual_mm2.every((residual_mm2) => Math.abs(residual_mm2) <= this.tolerance_mm2)) break;
        const coupled = now.stiff.map((stiff) => ((share * this.weight) / sections.step_mm) * stiff);
        let change_mm = solved(now.width_mm, coupled, now.residual_mm2);
        let before = dot(now.residual_mm2, change_mm);
        let there_mm = height_mm;
        for (let halved = 0; halved < MOST_HALVED; halved += 1) {
          there_mm = height_mm.map((one_mm, i) => one_mm + change_mm[i]);
          now = this.state(through, there_mm, share);
          if (dot(now.residual_mm2, change_mm) <= OVERSHOT * -before) break;
          change_mm = change_mm.map((one_mm) => one_mm / 2);
          before /= 2;
        }
        height_mm = there_mm;
      }
      this.area_mm2 = this.area_mm2.map((area_mm2, i) => area_mm2 - share * net(now.flow, i));
      this.height_mm = this.area_mm2.map((area_mm2, i) => sections.height_mm(i, area_mm2));
    }

    // Flow and stiffness at the faces, width and residual of each cell, for heights at the end of a step.
    state(through, height_mm, share) {
      const faces = through.length;
      const [flow, stiff] = [new Float64Array(faces), new Float64Array(faces)];
      for (let face = 0; face < faces; face += 1) {
        [flow[face], stiff[face]] = flow_mm3_s(through[face], this.push(height_mm, face), this.m);
      }
      const [width_mm, residual_mm2] = [new Float64Array(faces + 1), new Float64Array(faces + 1)];
      for (let i = 0; i <= faces; i += 1) {
        const [filled_mm2, wide_mm] = this.sections.area_mm2(i, height_mm[i]);
        width_mm[i] = wide_mm;
        residual_mm2[i] = filled_mm2 - this.area_mm2[i] + share * net(flow, i);
      }
      return { flow, stiff, width_mm, residual_mm2 };
    }

    // Push at a face towards larger s, in Pa/mm.
    push(height_mm, face) {
      const { depth_mm, step_mm } = this.sections;
      const rise_mm = height_mm[face + 1] - depth_mm[face + 1] - (height_mm[face] - depth_mm[face]);
      return this.pull[face] - (this.weight / step_mm) * rise_mm;
    }

    // The conduit of each face, which is that of the cell upwind.
    faces(height_mm) {
      return Array.from({ length: height_mm.length - 1 }, (_, face) => {
        const upwind = face + (this.push(height_mm, face) < 0 ? 1 : 0);
        return conduit(this.paste, this.sections, upwind, Math.max(this.area_mm2[upwind], 0), height_mm[upwind]);
      });
    }
  }

  // Outflow of cell i less its inflow.
  const net = (flow, i) => (i < flow.length ? flow[i] : 0) - (i > 0 ? flow[i - 1] : 0);
  const dot = (one, other) => {
    let total = 0;
    for (let i = 0; i < one.length; i += 1) total += one[i] * other[i];
    return total;
  };

  // Changes of height by the symmetric tridiagonal system, which LAPACK's dptsv solves in Python.
  const solved = (width_mm, coupled, residual_mm2) => {
    const count = width_mm.length;
    const [pivot, change_mm] = [new Float64Array(count), new Float64Array(count)];
    for (let i = 0; i < count; i += 1) {
      const [upper, lower] = [i > 0 ? coupled[i - 1] : 0, i < count - 1 ? coupled[i] : 0];
      const factor = i > 0 ? -upper / pivot[i - 1] : 0;
      pivot[i] = width_mm[i] + upper + lower + factor * upper;
      change_mm[i] = -residual_mm2[i] - (i > 0 ? factor * change_mm[i - 1] : 0);
    }
    for (let i = count - 1; i >= 0; i -= 1) {
      change_mm[i] = (change_mm[i] + (i < count - 1 ? coupled[i] * change_mm[i + 1] : 0)) / pivot[i];
    }
    return change_mm;
  };

  // simulate/slot/fitness.py

  // Three numbers that describe the case, for a fill of ``dispensed_mm3``.
  const fitness_of = (shape, dispensed_mm3, paste) => {
    const sections = new Trapezoids(shape, 0);
    const fill = dispensed_mm3 / sum(sections.full_mm2) / sections.step_mm;
    const held_mm = paste.yield_stress_pa / weight_pa_mm(paste);
    const area_mm2 = sections.full_mm2.map((full_mm2) => Math.min(fill, 1) * full_mm2);
    const height_mm = area_mm2.map((one_mm2, i) => sections.height_mm(i, one_mm2));
    const slope = area_mm2.map(
      (one_mm2, i) =>
        (paste.wall_share * held_mm) / sections.holding_mm(one_mm2, sections.wetted_mm(i, height_mm[i]))
    );
    const mound_mm = Math.max(dot(slope, height_mm) / slope.length, MOUND * held_mm);
    return { slope: mean(slope), mound_mm, fill };
  };

  return { fill, fitness_of, interp };
})();
