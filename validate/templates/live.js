// Changes the settings of the report's trial by sliders and shows their level by the fast model of slot.js.
// Without scripts the chapter is hidden.
(() => {
  const stage = document.getElementById("live");
  const model = JSON.parse(document.getElementById("live-model").textContent);
  const NAMES = {
    flow_mm3_s: ["Flow", "mm³/s"],
    speed_mm_s: ["Speed of the nozzle", "mm/s"],
    yield_stress_pa: ["Yield stress", "Pa"],
    mean_width_mm: ["Mean width of the crack", "mm"],
  };
  const SETTINGS = Object.keys(NAMES).filter((name) => name in model.sliders);
  const DIGITS = 6; // Significant digits of a setting, on the page and in the file
  const shown = (value, digits = 4) => String(Number(value.toPrecision(digits)));
  const rounded_down = (value) => {
    const digit = 10 ** (Math.floor(Math.log10(value)) - 1);
    return shown(Math.floor(value / digit) * digit);
  };

  // Settings after a number of steps of each slider; without steps, exactly those of the run.
  const settings_at = (steps) =>
    Object.fromEntries(
      SETTINGS.map((name) => {
        const { as_run, step } = model.sliders[name];
        const value = as_run + step * (steps[name] ?? 0);
        return [name, steps[name] ? Number(value.toPrecision(DIGITS)) : value];
      })
    );

  const computed = (steps) => {
    const settings = settings_at(steps);
    const { given_mm3, ...sections } = { s_mm: model.s_mm, ...model.widths[steps.mean_width_mm ?? 0] };
    const slower = model.sliders.speed_mm_s.as_run / settings.speed_mm_s;
    const t_s = model.path.t_s.map((one_s) => one_s * slower);
    const volume_mm3 = settings.flow_mm3_s * t_s.at(-1);
    const path = {
      ...model.path,
      t_s,
      after_s: model.after_s * slower,
      given_mm3: given_mm3.map((one_mm3) => (one_mm3 / given_mm3.at(-1)) * volume_mm3),
    };
    const paste = { ...model.paste, yield_stress_pa: settings.yield_stress_pa };
    const filled = slot.fill(sections, path, paste, model);
    const above_mm = Math.max(0, ...filled.level_mm);
    const fitness = { ...slot.fitness_of(sections, volume_mm3, paste), above_mm };
    const { full_mm2, step_mm } = filled.sections;
    const above_mm3 = filled.area_mm2.reduce((total, area, i) => total + Math.max(0, area - full_mm2[i]) * step_mm, 0);
    return { ...filled, above_mm3, fitness, unfit: [...unfit(fitness), ...model.unknown] };
  };

  // Sentences on the reasons why the model is unfit.
  const unfit = (fitness) =>
    Object.entries(model.limits)
      .filter(([name, [most]]) => fitness[name] > most)
      .map(([name, [most, digits, sentence]]) => sentence.replace("{}", fitness[name].toFixed(digits)).replace("{}", most));
  const [steepest, tallest_mm, fullest] = ["slope", "mound_mm", "fill"].map((name) => model.limits[name][0]);

  const first = computed({});
  const floor_at = (s_mm) => -slot.interp(s_mm, model.s_mm, first.sections.depth_mm);
  const moved = (now, s_mm, i) => {
    const at = (filled) => slot.interp(s_mm, model.s_mm, filled.level_mm);
    if (!model.by_particles) return at(now);
    // The change may reach below the floor, which a level may not.
    return Math.max(floor_at(s_mm), model.as_run.level_mm[i] + at(now) - at(first));
  };
  const mean = (line) => {
    let area = 0;
    for (let i = 1; i < line.length; i += 1) area += ((line[i][1] + line[i - 1][1]) / 2) * (line[i][0] - line[i - 1][0]);
    return area / (line.at(-1)[0] - line[0][0]);
  };

  // The picture

  const svg = stage.querySelector("svg");
  const [LEFT_PX, RIGHT_PX, TOP_PX, BOTTOM_PX, HIGH_PX] = [38, 10, 10, 24, 280];
  const floor_mm = -Math.max(...first.sections.depth_mm);
  const as_run = model.as_run.s_mm.map((s_mm, i) => [s_mm, model.as_run.level_mm[i]]);
  const length_mm = model.s_mm.at(-1) + model.s_mm[0];

  const part = (kind, attributes, text = "") => {
    const element = document.createElementNS(svg.namespaceURI, kind);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.textContent = text;
    svg.append(element);
  };
  const ticks = (low, high, count) => {
    const rough = (high - low) / count;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((digit) => digit * power >= rough);
    const start = Math.ceil(low / step);
    return Array.from({ length: Math.floor(high / step) - start + 1 }, (_, i) => (start + i) * step);
  };
  const draw = (line) => {
    const width_px = svg.clientWidth;
    if (!width_px) return;
    svg.setAttribute("viewBox", `0 0 ${width_px} ${HIGH_PX}`);
    svg.replaceChildren();
    const top_mm = Math.max(2, ...line.map(([, level_mm]) => level_mm + 1), ...as_run.map(([, level_mm]) => level_mm + 1));
    const x = (s_mm) => LEFT_PX + (s_mm / length_mm) * (width_px - LEFT_PX - RIGHT_PX);
    const y = (level_mm) => TOP_PX + ((top_mm - level_mm) / (top_mm - floor_mm)) * (HIGH_PX - TOP_PX - BOTTOM_PX);
    const points = (places) => places.map(([s_mm, level_mm]) => `${x(s_mm).toFixed(1)},${y(level_mm).toFixed(1)}`).join(" ");
    for (const level_mm of ticks(floor_mm, top_mm, 6)) {
      const kind = level_mm === 0 ? "face" : "grid";
      part("line", { class: kind, x1: LEFT_PX, x2: width_px - RIGHT_PX, y1: y(level_mm), y2: y(level_mm) });
      part("text", { x: LEFT_PX - 6, y: y(level_mm) + 4, "text-anchor": "end" }, shown(level_mm));
    }
    for (const s_mm of ticks(0, length_mm, width_px / 90)) {
      part("text", { x: Math.min(x(s_mm), width_px - 16), y: HIGH_PX - 6, "text-anchor": "middle" }, shown(s_mm));
    }
    if (model.band) {
      const half_mm = (s_mm) => slot.interp(s_mm, model.band.s_mm, model.band.level_mm);
      const inside = line.filter(([s_mm]) => s_mm >= model.band.s_mm[0] && s_mm <= model.band.s_mm.at(-1));
      const upper = inside.map(([s_mm, level_mm]) => [s_mm, level_mm + half_mm(s_mm)]);
      const lower = inside.map(([s_mm, level_mm]) => [s_mm, Math.max(floor_at(s_mm), level_mm - half_mm(s_mm))]);
      part("polygon", { class: "band", points: points([...upper, ...lower.reverse()]) });
    }
    part("polyline", { class: "as-run", points: points(as_run) });
    part("polyline", { class: "now", points: points(line) });
    model.readings?.s_mm.forEach((s_mm, i) => {
      part("circle", { class: "read", cx: x(s_mm), cy: y(model.readings.level_mm[i]), r: 3.5 });
    });
  };

  // Settings, figures, buttons

  const steps = {};
  const sliders = stage.querySelector(".sliders");
  for (const name of SETTINGS) {
    const { low, high } = model.sliders[name];
    const row = document.createElement("div");
    row.innerHTML = `<label for="live-${name}"></label><input type="range" id="live-${name}"><output for="live-${name}"></output>`;
    row.firstChild.textContent = NAMES[name][0];
    const input = row.querySelector("input");
    Object.assign(input, { min: low, max: high, step: 1, value: 0 });
    input.addEventListener("input", () => {
      steps[name] = Number(input.value);
      show();
    });
    sliders.append(row);
  }

  const figures = stage.querySelector("dl");
  const fixed = (value, digits) => value.toFixed(digits).replace("-", "−");
  const changed = (value, digits) => {
    const text = fixed(value, digits).replace(/^−(0(\.0+)?)$/, "$1");
    return text.startsWith("−") ? text : `+${text}`;
  };
  const figures_of = (now, line) => {
    const above = model.by_particles
      ? `${Math.round(model.above_mm3)} mm³ as run, ${changed(now.above_mm3 - first.above_mm3, 0)} mm³`
      : `${Math.round(now.above_mm3)} mm³`;
    const levels_mm = line.map(([, level_mm]) => level_mm);
    return {
      "mean level": `${fixed(mean(line), 2)} mm (${changed(mean(line) - mean(as_run), 2)})`,
      "lowest, highest": `${fixed(Math.min(...levels_mm), 1)}, ${fixed(Math.max(...levels_mm), 1)} mm`,
      "over the face": above,
      sealant: `${(now.dispensed_mm3 / 1e3).toFixed(2)} ml, ${now.fitness.fill.toFixed(2)} of the crack`,
    };
  };

  let line = as_run;
  const update = () => {
    const now = computed(steps);
    line = model.as_run.s_mm.map((s_mm, i) => [s_mm, moved(now, s_mm, i)]);
    for (const [name, value] of Object.entries(settings_at(steps))) {
      const input = document.getElementById(`live-${name}`);
      const text = `${shown(value)} ${NAMES[name][1]}`;
      input.setAttribute("aria-valuetext", text);
      input.nextSibling.textContent = text;
    }
    const warning = stage.querySelector(".warning");
    const { slope, mound_mm, fill } = now.fitness;
    const { yield_stress_pa, flow_mm3_s } = settings_at(steps);
    // Slope and mound grow with the yield stress, and the fill with the flow.
    const most_pa = yield_stress_pa * Math.min(steepest / slope, tallest_mm / mound_mm);
    const most_mm3_s = (flow_mm3_s * fullest) / fill;
    stage.querySelector(".domain").textContent =
      `The fast model's domain: held slope ${slope.toFixed(2)}, at most ${steepest}; mound ${mound_mm.toFixed(1)} mm, ` +
      `at most ${tallest_mm}` +
      (yield_stress_pa > 0 ? ` (so a yield stress of at most ${rounded_down(most_pa)} Pa)` : "") +
      `; fill ${fill.toFixed(2)}, at most ${fullest} (a flow of at most ${rounded_down(most_mm3_s)} mm³/s).`;
    const reasons = now.unfit.join(" ");
    if (warning.dataset.reasons !== reasons) {
      const title = Object.assign(document.createElement("strong"), { textContent: "The fast model is UNFIT here. " });
      warning.replaceChildren(...(reasons ? [title, reasons] : []));
      warning.dataset.reasons = reasons;
    }
    warning.hidden = !reasons;
    stage.classList.toggle("unfit", Boolean(reasons));
    figures.replaceChildren(
      ...Object.entries(figures_of(now, line)).map(([label, value]) => {
        const cell = document.createElement("div");
        for (const [kind, text] of [["dt", label], ["dd", value]]) {
          cell.append(Object.assign(document.createElement(kind), { textContent: text }));
        }
        return cell;
      })
    );
    draw(line);
    stage.dataset.level = line.map(([, level_mm]) => level_mm.toFixed(5)).join(" ");
  };
  let waiting = 0;
  const show = () => {
    waiting ||= requestAnimationFrame(() => {
      waiting = 0;
      update();
    });
  };

  // The trial file of the settings, without those that are neither in the trial nor changed.
  const trial_text = () => {
    const settings = settings_at(steps);
    const gives_s = (model.path.t_s.at(-1) * model.sliders.speed_mm_s.as_run) / settings.speed_mm_s;
    const volume_ml = Number(((settings.flow_mm3_s * gives_s) / 1e3).toPrecision(DIGITS + 1));
    const written = { ...settings, volume_ml };
    const left_out = (name) => model.sliders[name]?.in_trial === false && !steps[name];
    return model.trial.replace(/^(\w+) = "@"\n/gm, (_, name) => (left_out(name) ? "" : `${name} = ${written[name]}\n`));
  };
  const buttons = {
    reset: () => {
      for (const input of sliders.querySelectorAll("input")) input.value = 0;
      for (const name of Object.keys(steps)) delete steps[name];
      show();
    },
    trial: () => {
      const href = `data:application/toml;charset=utf-8,${encodeURIComponent(trial_text())}`;
      Object.assign(document.createElement("a"), { href, download: "trial-changed.toml" }).click();
    },
  };
  for (const button of stage.querySelectorAll("button")) button.addEventListener("click", buttons[button.value]);

  stage.hidden = false;
  document.getElementById("live-link").hidden = false;
  new ResizeObserver(() => draw(line)).observe(svg);
  update();
})();
