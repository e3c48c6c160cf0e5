// @ts-check
"use strict";

const SAMPLES = 400;
/** A crush that no vehicle reaches [m]. */
const NEVER = 1e300;
/** Before the end of the simulation by so little that rounding cannot put the last sample behind it. */
const BEFORE_THE_END = 1 - 1e-14;
/** Columns that `sweep simulate`, which goes on beyond the limit, takes from a row of `sweep run`, which stops there. */
const DECIDED = ["verdict", "reason", "margin", "rating", "time_to_limit_s", "overlap_m", "validity", "step_s"];

/**
 * The coefficient of a law of the soil's ultimate resistance over the paper's: `boulder_sweep.judge.resistance`.
 * @param {string} law
 * @param {KernelDesign} design
 * @returns {number}
 */
function resistanceFactor(law, { phi, W, d }) {
  const K_p = Math.tan(Math.PI / 4 + phi / 2) ** 2;
  if (law === "broms") return 3 / K_p;
  if (law === "width_capped") return Math.min(1, (1 + (1.6 * (K_p - 1 / K_p) ** 0.67) / (1 + (5 * W) / d)) / K_p);
  return 1;
}

/**
 * What a slope and water up to the soil line leave of the resistance: `boulder_sweep.judge.ground`.
 * @param {{slope_deg: number, water_table_m: number | null}} ground
 * @param {KernelDesign} design
 * @returns {number}
 */
function groundFactor({ slope_deg, water_table_m }, { phi, rho_s }) {
  const slope = slope_deg / DEGREES;
  const falling = 1 - Math.sqrt((Math.sin(phi) * Math.sin(Math.max(phi - slope, 0))) / Math.cos(slope));
  const submerged = water_table_m === 0 ? 1 - 1000 / rho_s : 1;
  return (slope ? ((1 - Math.sin(phi)) / falling) ** 2 : 1) * submerged;
}

/** Designs by the columns of the table in, judged rows and motions out. */
class Simulator {
  /** @param {any} data of the page @param {Kernel} kernel */
  constructor(data, kernel) {
    this.data = data;
    this.kernel = kernel;
    const horizon = data.settings[data.layout.settings.indexOf("horizon")];
    this.times = Float64Array.from({ length: SAMPLES + 1 }, (_, k) => ((horizon * k) / SAMPLES) * BEFORE_THE_END);
  }

  /** @param {Record<string, number>} changed by name @returns {number[]} settings of the kernel */
  settings(changed) {
    const { settings } = this.data.layout;
    return this.data.settings.map((/** @type {number} */ value, /** @type {number} */ k) => changed[settings[k]] ?? value);
  }

  /**
   * A design in the kernel's terms.
   * @param {Record<string, number>} inputs by the columns of the table
   * @returns {KernelDesign}
   */
  kernelDesign(inputs) {
    const { layout, resistance, ground } = this.data;
    /** @type {KernelDesign} */
    const design = Object.fromEntries(
      layout.design.map((/** @type {string} */ field) => {
        const value = inputs[layout.columns[field]];
        return [field, field === "phi" ? value / DEGREES : value];
      }),
    );
    // Without a second spring it is like the first, from a crush on that is never reached.
    const springs = { k_2: design.k_2 ?? design.k_v, s_2: design.s_2 ?? NEVER };
    const factor = groundFactor(ground, design) * resistanceFactor(resistance, design);
    return { ...design, ...springs, K_epsilon: design.K_epsilon * factor };
  }

  /**
   * Fill in what follows from the other inputs, and say what cannot be.
   * @param {Record<string, number>} inputs
   * @returns {{inputs: Record<string, number>, refusal: string}}
   */
  completed(inputs) {
    const exposed = inputs.boulder_height_m - inputs.embedment_depth_m;
    const [bumper, hood] = [inputs.bumper_height_m, inputs.hood_height_m];
    const impact = this.data.face ? 0.5 * (Math.min(exposed, hood) + bumper) : inputs.impact_height_m;
    let refused = 0;
    if (inputs.vehicle_second_spring_N_m < inputs.vehicle_spring_N_m) refused = 4;
    if (!this.data.face && impact > exposed * (1 + 1e-12) && exposed > bumper) refused = 3;
    if (hood < bumper) refused = 2;
    if (exposed <= 0) refused = 1;
    return { inputs: { ...inputs, impact_height_m: impact }, refusal: this.data.refusals[refused] };
  }

  /**
   * Simulate and judge designs as `sweep run` does its rows, up to the limit.
   * @param {Record<string, number>[]} designs
   * @returns {Judged[]}
   */
  rows(designs) {
    const found = this.judged(designs, { stop_at_limit: 1 });
    for (const finer of this.data.finer) {
      const open = found.flatMap((one, row) => (this.isOpen(one) ? [row] : []));
      if (open.length === 0) break;
      const again = this.judged(open.map((row) => designs[row]), { ...finer, stop_at_limit: 1 });
      again.forEach((one, k) => {
        if (one.verdict !== "error") found[open[k]] = one;
      });
    }
    return found;
  }

  /** @param {Judged} one @returns {boolean} whether finer steps may decide it */
  isOpen(one) {
    return (one.verdict === "undecided" && one.reason === "error") || this.data.rules.open.includes(one.reason);
  }

  /**
   * Simulate and judge one design as `sweep simulate` does, beyond the limit.
   * @param {Record<string, number>} design
   * @returns {{judged: Judged, motion: Motion, inputs: Record<string, number>}}
   */
  whole(design) {
    const { inputs, refusal } = this.completed(design);
    const [decided] = this.rows([design]);
    /** @type {Record<string, number>[]} */
    const finer = this.data.finer;
    const steps = finer.find((one) => this.step(one) === decided.step_s) ?? {};
    const beyond = { ...steps, stop_at_limit: 0 };
    const [judged] = this.judged([design], beyond);
    if (judged.verdict !== "error") for (const name of DECIDED) judged[name] = decided[name];
    const times = refusal === "" ? this.times : new Float64Array(0);
    return { judged, motion: this.kernel.history(this.kernelDesign(inputs), this.settings(beyond), times), inputs };
  }

  /** @param {Record<string, number>} changed settings @returns {number} step of the solution that is reported [s] */
  step(changed) {
    const settings = this.settings(changed);
    /** @param {string} name */
    const of = (name) => settings[this.data.layout.settings.indexOf(name)];
    return of("error_estimate") > 0 ? 0.5 * of("h") : of("h");
  }

  /**
   * @param {Record<string, number>[]} designs
   * @param {Record<string, number>} changed settings
   * @returns {Judged[]}
   */
  judged(designs, changed) {
    const complete = designs.map((design) => this.completed(design));
    const outcomes = this.kernel.outcomes(complete.map((one) => this.kernelDesign(one.inputs)), this.settings(changed));
    return complete.map(({ inputs, refusal }, row) => {
      const found = judge(outcomes, row, inputs, this.data.rules);
      found.step_s = found.end_time_s === null ? null : this.step(changed);
      if (refusal === "") return found;
      const nothing = Object.fromEntries(Object.keys(found).map((name) => [name, null]));
      return { ...nothing, verdict: "error", reason: refusal, rating: null };
    });
  }
}
