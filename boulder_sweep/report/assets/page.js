// @ts-check
"use strict";

/** Designs along each side of the map around a design, and where each of them takes long. */
const AROUND = 40;
const FEW_AROUND = 12;
const SPREAD = 0.25;
/** Time without a change after which the rest of the page follows the controls [ms]. */
const PAUSE = 150;
/** Time for which the map around a design is computed before the page answers its reader again [ms]. */
const LONGEST_BLOCK_MS = 100;
/** Width that is printed on a page [px], and heights of A4 and Letter between their margins; a little less than there is. */
const PAPER = { width: 676, si: 994, us: 928 };
/** Least size of what is written beside a figure on paper [px]: 8 pt. */
const LEAST_PX = 10.7;

/** The whole page: what the reader does, and what is simulated and shown for it. */
class Page {
  /** @param {any} data @param {Kernel} kernel @param {Plots} plots @param {Uint8Array} codes */
  constructor(data, kernel, plots, codes) {
    this.data = data;
    this.simulator = new Simulator(data, kernel);
    this.plots = plots;
    this.codes = codes;
    this.units = new Units(data.unit, data.units);
    /** @type {Input[]} */
    this.inputs = data.inputs;
    this.controls = new Controls(data, this.units);
    /** @type {Record<string, number>} the design in the simulator */
    this.design = { ...data.start };
    /** @type {Record<string, number>[]} */
    this.list = [];
    /** @type {Record<string, number>} */
    this.held = {};
    /** @type {Record<string, {scene: Scene, motion: Motion}>} */
    this.motions = {};
    this.waiting = 0;
    /** Of maps around a design; another change makes the one that is being computed the last but one. */
    this.rounds = 0;
    this.axes = { live: new Axes("live-across", "live-up"), sweep: data.rows?.mapped ? new Axes("across", "up") : null };
    const panels = ["live", ...data.chosen.map((/** @type {any} */ _, /** @type {number} */ k) => `chosen${k}`)];
    /** @type {Record<string, Player>} */
    this.players = Object.fromEntries(
      panels.map((panel) => [panel, new Player(panel, () => this.showScene(panel))]),
    );
    /** @param {string} panel */
    const map = (panel) => new VerdictMap(panel, plots, this.units, data.colours);
    this.maps = { live: map("live"), sweep: map("sweep") };
  }

  /** @param {string} panel */
  showEnergy(panel) {
    this.plots.drawEnergy(panel, this.motions[panel].motion, this.units, this.data.parts, this.data.rules.rotation);
  }

  /** Show all of a design but where the energy goes. @param {string} panel @param {Record<string, number>} design */
  showMotion(panel, design) {
    const { judged: found, motion, inputs } = this.simulator.whole(design);
    this.showFound(panel, found, motion, inputs);
  }

  /** @param {string} panel @param {Judged} found @param {Motion} motion @param {Record<string, number>} inputs */
  showFound(panel, found, motion, inputs) {
    const grade = this.data.rows === null ? "" : gradeOf(this.data.rows, this.codes, inputs);
    this.showVerdict(byId(`${panel}-verdict`) ?? byId("verdict"), found, grade);
    const table = byId(`${panel}-outcomes`) ?? byId("outcomes");
    table.replaceChildren(...this.data.outcomes.map((/** @type {any} */ one) => this.row(one.label, found[one.name], one.unit)));
    const flags = String(found.validity ?? "").split(";").filter((name) => name !== "");
    byId(`${panel}-flags`).replaceChildren(...flags.map((name) => element("li", this.data.rules.flags[name])));
    this.plots.draw(panel, motion, this.units, this.data.rules.rotation);
    this.motions[panel] = { scene: this.scene(inputs), motion };
    this.players[panel].load(motion.time, this.telling(motion));
    this.showScene(panel);
  }

  /** @param {Motion} motion @returns {number} the sample that tells most: the limit reached, or the largest rotation */
  telling(motion) {
    const theta = (motion.columns.theta_b ?? new Float64Array(0)).map(Math.abs);
    const over = theta.findIndex((value) => value >= this.data.rules.rotation);
    return over >= 0 ? over : theta.indexOf(Math.max(...theta, 0));
  }

  /** @param {Record<string, number>} one @returns {Scene} */
  scene(one) {
    const outline = this.simulator.outline(one);
    const reach = reachOf(outline, one.embedment_depth_m + one.impact_height_m);
    return {
      outline, depth: one.embedment_depth_m,
      blow: one.impact_height_m, friction: one.friction_angle_deg / DEGREES, mass: one.vehicle_mass_kg,
      speed: one.impact_speed_m_s, spring: one.vehicle_spring_N_m, damper: one.vehicle_damper_N_s_m,
      bumper: one.bumper_height_m, hood: one.hood_height_m, bed: one.bed_offset_m,
      line: reach + this.data.rules.limits[1], rating: this.data.rules.rating,
    };
  }

  /** @param {string} panel */
  showScene(panel) {
    const { scene, motion } = this.motions[panel];
    const sample = Math.max(Number(byId(`${panel}-time`).value), 0);
    new SideView(byId(`${panel}-scene`)).draw(scene, motion, sample);
    const words = motion.time.length === 0 ? "no time history" : [
      `${(1000 * motion.time[sample]).toFixed(0)} ms`,
      `rotation ${number(motion.columns.theta_b[sample] * DEGREES)}°`,
      `vehicle ${this.units.text(motion.columns.x_v[sample], "m")}`,
    ].join(" · ");
    byId(`${panel}-caption`).textContent = words;
  }

  /** @param {HTMLElement} place @param {Judged} found @param {string} grade of a pass by the table; empty where unknown */
  showVerdict(place, found, grade) {
    place.className = `verdict ${found.verdict}`;
    const sign = { pass: "✔", fail: "✘", undecided: "?", error: "!" }[found.verdict];
    const limit = number(this.data.rules.rotation * DEGREES);
    const words = [];
    if (found.reason !== "") words.push(this.data.words[found.reason] ?? found.reason);
    if (found.margin !== null) words.push(`margin ${percent(found.margin)}`);
    if (found.max_rotation_deg !== null) words.push(`turns ${number(found.max_rotation_deg)}°, limit ${limit}°`);
    if (found.verdict === "pass" && grade !== "") words.push(`${grade} in the table`);
    place.replaceChildren(element("b", `${sign} ${found.verdict}`), element("span", words.length > 0 ? `: ${words.join("; ")}` : ""));
  }

  /** @param {string} label @param {number | string | null} value @param {string} unit @param {number} [up] see `Units.text` */
  row(label, value, unit, up = 0) {
    const line = document.createElement("tr");
    const head = element("th", label);
    head.setAttribute("scope", "row");
    line.append(head, element("td", this.units.text(value, unit, up)));
    return line;
  }

  /** Simulate the design of the controls, at once; its energy and the designs around it, as soon as the reader pauses. */
  update() {
    clearTimeout(this.waiting);
    this.rounds += 1;
    const { refused } = this.controls;
    const isRefused = Object.keys(refused).length > 0;
    for (const name of ["add", "copy"]) byId(name).disabled = isRefused;
    const { inputs, refusal, at } = this.simulator.completed(this.design);
    this.controls.say(isRefused || refusal === "" ? refused : { [at]: refusal });
    this.controls.show(inputs);
    if (isRefused) {
      this.refuse(refused, inputs);
      return;
    }
    this.showMotion("live", this.design);
    byId("yaml").value = yamlOf(this.data, this.design, this.units);
    this.waiting = setTimeout(() => {
      this.showEnergy("live");
      this.showAround();
    }, PAUSE);
  }

  /**
   * Show nothing but why the values typed are refused.
   * @param {Record<string, string>} refused by the names of inputs
   * @param {Record<string, number>} inputs the last ones that were not
   */
  refuse(refused, inputs) {
    const words = this.inputs.filter(({ name }) => name in refused).map(({ name, label }) => `${label}: ${refused[name]}`);
    const nothing = Object.fromEntries(this.data.outcomes.map((/** @type {any} */ one) => [one.name, null]));
    const found = /** @type {Judged} */ ({ ...nothing, verdict: "error", reason: words.join("; "), margin: null, rating: null });
    this.showFound("live", found, this.simulator.motionless(), inputs);
    this.showEnergy("live");
    byId("flags").replaceChildren();
    byId("yaml").value = "";
    this.showCells([]);
    byId("live-words").textContent = "";
  }

  /** Simulate designs over two inputs around the one of the controls, without keeping the reader waiting. */
  async showAround() {
    const round = (this.rounds += 1);
    const { across, up } = this.axes.live;
    const size = this.simulator.isSlow ? FEW_AROUND : AROUND;
    /** @param {string} name */
    const line = (name) => {
      const input = /** @type {Input} */ (this.inputs.find((one) => one.name === name));
      const here = this.design[name];
      const [low, high] = [Math.max(here * (1 - SPREAD), input.low), Math.min(here * (1 + SPREAD), input.high)];
      return Array.from({ length: size }, (_, k) => low + ((high - low) * k) / (size - 1));
    };
    const places = line(across).flatMap((x) => line(up).map((y) => ({ x, y })));
    const designs = places.map(({ x, y }) => ({ ...this.design, [across]: x, [up]: y }));
    /** @type {Judged[]} */
    const found = [];
    let since = performance.now();
    for (const design of designs) {
      found.push(...this.simulator.rows([design]));
      if (performance.now() - since < LONGEST_BLOCK_MS) continue;
      byId("live-words").textContent = `Simulating ${found.length} of ${designs.length} designs around this one.`;
      await new Promise((next) => setTimeout(next));
      if (round !== this.rounds) return;
      since = performance.now();
    }
    const cells = places.map(({ x, y }, k) => ({
      x, y, pick: () => ({ [across]: x, [up]: y }),
      name: found[k].reason === "" ? found[k].verdict : `${found[k].verdict}: ${found[k].reason}`,
    }));
    this.showCells(cells);
    const passing = found.filter((one) => one.verdict === "pass").length;
    byId("live-words").textContent = `Of ${size} × ${size} designs within a quarter of this one, ${passes(passing)}.`;
  }

  /** Draw the map of designs around the one of the controls. @param {Cell[]} cells */
  showCells(cells) {
    const { across, up } = this.axes.live;
    const of = (/** @type {string} */ name) => /** @type {Input} */ (this.inputs.find((one) => one.name === name));
    const [labels, units] = [{ x: of(across).label, y: of(up).label }, { x: of(across).unit, y: of(up).unit }];
    this.maps.live.draw(cells, labels, units, { x: this.design[across], y: this.design[up] });
  }

  /** Draw the map of the table. */
  showTable() {
    const { rows } = this.data;
    const { across, up } = /** @type {Axes} */ (this.axes.sweep);
    for (const control of byId("held").children) control.hidden = [across, up].includes(control.dataset.name);
    const cells = tableCells(rows, this.codes, across, up, this.held);
    if (rows.asked !== "" && ![across, up].includes(rows.asked)) {
      for (const cell of cells.filter((one) => isPass(one.name))) {
        cell.answer = `, ${rows.labels[rows.asked]} ${this.units.text(cell.pick()[rows.asked], rows.units[rows.asked])}`;
      }
    }
    const labels = { x: rows.labels[across], y: up === "" ? "" : rows.labels[up] };
    const units = { x: rows.units[across], y: up === "" ? "" : rows.units[up] };
    this.maps.sweep.draw(cells, labels, units, null);
    byId("sweep-words").textContent = summed(cells);
  }

  showList() {
    const columns = [...this.data.outcomes, ...this.inputs];
    byId("list").hidden = this.list.length === 0;
    byId("list-head").replaceChildren(...["verdict", ...columns.map((one) => this.units.title(one.label, one.unit))].map((words) => element("th", words)));
    byId("list-rows").replaceChildren(
      ...this.list.map((design) => {
        const line = document.createElement("tr");
        const { inputs, judged } = this.simulator.whole(design);
        const known = { ...inputs, ...judged };
        const values = columns.map((one) => this.units.bare(known[one.name], one.unit));
        line.append(...[`${judged.verdict} ${judged.reason}`, ...values].map((words) => element("td", words)));
        return line;
      }),
    );
  }

  /** @returns {string} the list with the names and units of the table */
  csv() {
    const found = this.list.map((design) => this.simulator.whole(design));
    const names = [...this.inputs.map((input) => input.name), ...Object.keys(found[0]?.judged ?? {})];
    return csvOf(names, found.map(({ inputs, judged }) => ({ ...inputs, ...judged })));
  }

  /** Show everything anew, in other units. */
  refresh() {
    document.documentElement.dataset.units = this.units.system;
    for (const place of document.querySelectorAll(".quantity")) {
      const { value, unit, up } = /** @type {HTMLElement} */ (place).dataset;
      place.textContent = this.units.text(Number(value), String(unit), Number(up ?? 0));
    }
    this.data.chosen.forEach((/** @type {any} */ one, /** @type {number} */ k) => {
      this.showMotion(`chosen${k}`, one.inputs);
      this.showEnergy(`chosen${k}`);
      byId(`chosen${k}-inputs`).replaceChildren(
        ...this.inputs.map((input) => this.row(input.label, one.inputs[input.name], input.unit, Number(input.name === "embedment_depth_m"))),
      );
    });
    if (this.axes.sweep !== null) {
      this.showHeld();
      this.showTable();
    }
    this.update();
    this.showList();
  }

  /** Controls for the inputs that the map of the table holds. */
  showHeld() {
    const { rows } = this.data;
    const names = Object.keys(rows.values).filter((name) => rows.grid && rows.values[name].length > 1);
    byId("held").replaceChildren(
      ...names.map((name) => {
        const values = rows.values[name];
        this.held[name] ??= rows.held[name];
        const label = element("label", "");
        label.dataset.name = name;
        const words = element("span", "");
        const slider = document.createElement("input");
        Object.assign(slider, { type: "range", min: "0", max: String(values.length - 1), value: String(this.held[name]) });
        const tell = () => {
          const value = values[this.held[name]];
          words.textContent = `${rows.labels[name]}: ${rows.sets[name]?.names[value] ?? this.units.text(value, rows.units[name])}`;
          slider.setAttribute("aria-valuetext", words.textContent);
        };
        slider.addEventListener("input", () => {
          this.held[name] = Number(slider.value);
          tell();
          this.showTable();
        });
        tell();
        label.append(words, slider);
        return label;
      }),
    );
    for (const name of Object.keys(rows.values)) this.held[name] ??= 0;
  }

  /** @param {Record<string, number>} given inputs, embedment_ratio among them perhaps */
  take(given) {
    const { embedment_ratio: ratio, ...inputs } = given;
    for (const [axis, own] of Object.entries(/** @type {TableRows["sets"]} */ (this.data.rows?.sets ?? {}))) {
      if (!(axis in inputs)) continue;
      for (const [name, values] of Object.entries(own.inputs)) inputs[name] = values[inputs[axis]];
      delete inputs[axis];
    }
    Object.assign(this.design, inputs);
    if (ratio !== undefined) this.design.embedment_depth_m = ratio * this.design.boulder_height_m;
    this.controls.refused = {};
    this.update();
  }

  /** Let the reader do what there is to do. */
  listen() {
    const { data } = this;
    this.controls.listen((given) => {
      Object.assign(this.design, given);
      this.update();
    });
    for (const player of Object.values(this.players)) player.listen();
    this.axes.live.listen(() => this.showAround());
    this.axes.sweep?.listen(() => this.showTable());
    this.maps.live.listen((cell) => this.take(cell.pick()));
    if (this.axes.sweep !== null) this.maps.sweep.listen((cell) => this.take({ ...data.rows.given, ...cell.pick() }));
    byId("reset").addEventListener("click", () => this.take(data.start));
    byId("add").addEventListener("click", () => {
      this.list.push({ ...this.design });
      this.showList();
    });
    byId("clear").addEventListener("click", () => {
      this.list = [];
      this.showList();
    });
    byId("csv").addEventListener("click", () => download(this.csv(), "designs.csv"));
    byId("copy").addEventListener("click", () => this.copy());
    byId("print").addEventListener("click", () => {
      this.writeForPaper();
      setTimeout(() => window.print(), PAUSE); // figures are drawn anew only between events
    });
    byId("units").addEventListener("change", () => {
      byId("units").focus(); // a box that is being typed into keeps its text, but not its unit
      this.units.system = byId("units").value;
      this.controls.refused = {};
      this.refresh();
    });
    /** @type {HTMLDetailsElement[]} */
    let opened = [];
    window.addEventListener("beforeprint", () => {
      opened = [...document.querySelectorAll("details")].filter((one) => !one.open);
      for (const one of opened) one.open = true;
      document.documentElement.style.setProperty("--screen", `${byId("live").clientWidth}px`);
      const size = this.shrunk;
      document.documentElement.style.setProperty("--paper", String(size));
      const above = document.querySelector("header")?.offsetHeight ?? 0;
      document.documentElement.style.setProperty("--sheet", `${PAPER[/** @type {"si" | "us"} */ (data.units)] / size - above}px`);
    });
    window.addEventListener("afterprint", () => {
      for (const one of opened) one.open = false;
      this.plots.write(WRITTEN);
    });
    for (const button of document.querySelectorAll(".load")) {
      button.addEventListener("click", () => {
        this.take(data.chosen[Number(/** @type {HTMLElement} */ (button).dataset.chosen)].inputs);
        byId("live").scrollIntoView();
      });
    }
  }

  /** By how much the page is made smaller to fit the paper. @returns {number} at most 1 */
  get shrunk() {
    return Math.min(PAPER.width / byId("live").clientWidth, 1);
  }

  /** Write beside figures so large that it can be read on paper. */
  writeForPaper() {
    this.plots.write(LEAST_PX / this.shrunk);
  }

  async copy() {
    try {
      await navigator.clipboard.writeText(byId("yaml").value);
      byId("copy").textContent = "Copied";
    } catch {
      byId("yaml").closest("details").open = true;
      byId("yaml").select();
      byId("copy").textContent = "Select and copy";
    }
    setTimeout(() => (byId("copy").textContent = "Copy as YAML"), 2000);
  }

  /** Fill the lists that axes are chosen from. */
  offer() {
    const { rows } = this.data;
    const inputs = this.inputs.filter(({ name }) => name !== "impact_height_m" && !this.data.boulder.fixed.includes(name));
    const all = /** @type {[string, string][]} */ (inputs.map((input) => [input.name, input.label]));
    this.axes.live.offer(all, "embedment_depth_m", "friction_angle_deg");
    byId("units").value = this.units.system;
    if (this.axes.sweep === null) return;
    const varying = Object.keys(rows.values).filter((name) => new Set(rows.values[name]).size > 1);
    // Numbers make the better axes; names stay on a slider as long as there are enough of them.
    const numbers = varying.filter((name) => !(name in rows.sets));
    const names = numbers.length > 1 ? numbers : varying;
    const options = /** @type {[string, string][]} */ (names.map((name) => [name, rows.labels[name]]));
    const first = rows.first[0] ?? names.find((name) => name.startsWith("embedment")) ?? names[0];
    const usual = names.find((name) => name === "boulder_height_m" && name !== first) ?? names.find((name) => name !== first);
    const second = rows.first[1] ?? usual ?? "";
    this.axes.sweep.offer(options, first, second);
  }
}

async function main() {
  const data = JSON.parse(byId("data").textContent);
  const [kernel, plots, codes] = await Promise.all([
    Kernel.load(data.kernel, data.layout, data.soil),
    Plots.load(data.bokeh),
    data.rows === null ? new Uint8Array(0) : unpacked(data.rows.codes),
  ]);
  const page = new Page(data, kernel, plots, codes);
  page.offer();
  page.listen();
  page.refresh();
  Object.assign(window, { page });
  if (location.hash === "#paper") page.writeForPaper();
  document.title = `${data.title}: boulder-sweep`;
  document.documentElement.dataset.ready = "yes";
}

main().catch((problem) => {
  byId("failure").hidden = false;
  byId("failure").textContent = `The simulator could not start: ${problem}. It needs a browser with WebAssembly, not older than 2023.`;
});
