// @ts-check
"use strict";

/**
 * Points of an outline from the foot up: height over the foot, width, and reach towards the vehicle and away from it,
 * linear in between; in metres, or as shares of height, width and length.
 * @typedef {[number, number, number, number][]} Outline
 */

/** Columns of an outline beside the height. */
const [WIDTH, NEAR, FAR] = [1, 2, 3];
/** @type {Outline} */
const BOX = [[0, 1, 0.5, 0.5], [1, 1, 0.5, 0.5]];

/**
 * The outline of a boulder of a design, to be drawn.
 * @param {Outline} profile as shares; without points a box
 * @param {{H: number, W: number, L: number}} sides [m]
 * @returns {Outline}
 */
function outlineOf(profile, { H, W, L }) {
  const shares = profile.length > 0 ? profile : BOX;
  return shares.map(([height, width, near, far]) => [height * H, width * W, near * L, far * L]);
}

/**
 * The value at a place between ascending ones, or at the nearer end.
 * @param {number[]} places
 * @param {number[]} values
 * @param {number} place
 */
function interpolated(places, values, place) {
  const next = places.findIndex((one) => one >= place);
  if (next < 0) return values[values.length - 1];
  if (next === 0) return values[0];
  const share = (place - places[next - 1]) / (places[next] - places[next - 1]);
  return values[next - 1] + share * (values[next] - values[next - 1]);
}

/** @param {Outline} outline @param {number} column @param {number} z height over the foot [m] @returns {number} */
function atHeight(outline, column, z) {
  return interpolated(outline.map(([height]) => height), outline.map((point) => point[column]), z);
}

/**
 * How far a boulder reaches from where it is struck to its far face, where that is farthest [m].
 * @param {Outline} outline
 * @param {number} blow height of the blow over the foot [m]
 */
function reachOf(outline, blow) {
  return atHeight(outline, NEAR, blow) + Math.max(...outline.map((point) => point[FAR]));
}

/**
 * The faces of a boulder from the side, from the foot up: x from where it is struck, z over the foot [m].
 * @param {Outline} outline
 * @param {number} blow height of the blow over the foot [m]
 * @returns {{near: [number, number][], far: [number, number][]}}
 */
function facesOf(outline, blow) {
  const struck = atHeight(outline, NEAR, blow);
  return {
    near: outline.map(([z, , near]) => [struck - near, z]),
    far: outline.map(([z, , , far]) => [struck + far, z]),
  };
}

/** Samples of a time history over the horizon. */
const SAMPLES = 400;
/** A boulder that overturns is shown for this share of the horizon beyond its limit, as by `sweep simulate`. */
const SEEN_AFTER = 0.5;
/** Before the end of the simulation by so little that rounding cannot put the last sample behind it. */
const BEFORE_THE_END = 1 - 1e-14;

/**
 * Volume of a boulder over the volume of the box of its sides: `boulder_sweep.designs.solidity_of`.
 * @param {Record<string, number>} inputs
 * @param {number} filled share of its box that the profile of the boulder fills
 * @returns {number}
 */
function solidityOf(inputs, filled) {
  if (!("boulder_mass_kg" in inputs)) return filled;
  const box = inputs.boulder_length_m * inputs.boulder_width_m * inputs.boulder_height_m;
  return inputs.boulder_mass_kg / (inputs.boulder_density_kg_m3 * box);
}

/** @param {number} step [s] @returns {number} the same to twelve digits, as tables have it */
function exact(step) {
  return Number(step.toPrecision(12));
}

/** Designs by the columns of the table in, judged rows and motions out. */
class Simulator {
  /** @param {any} data of the page @param {Kernel} kernel */
  constructor(data, kernel) {
    this.data = data;
    this.kernel = kernel;
    this.horizon = data.controls[0][this.at("horizon")];
  }

  /** @param {string} setting of the kernel @returns {number} its place among them */
  at(setting) {
    return this.data.layout.settings.indexOf(setting);
  }

  /**
   * A design in the kernel's terms.
   * @param {Record<string, number>} inputs by the columns of the table
   * @returns {KernelDesign}
   */
  kernelDesign(inputs) {
    const { layout, boulder } = this.data;
    /** @type {KernelDesign} */
    const design = Object.fromEntries(
      layout.design.map((/** @type {string} */ field) => {
        const value = inputs[layout.columns[field]];
        return [field, field === "phi" ? value / DEGREES : value];
      }),
    );
    // What is simulated has the mass of the boulder that was weighed.
    if ("boulder_mass_kg" in inputs) design.rho_b = inputs.boulder_mass_kg / (design.L * design.W * design.H * boulder.filled);
    return design;
  }

  /** @param {Record<string, number>} inputs @returns {Outline} of the boulder [m] */
  outline({ boulder_height_m: H, boulder_width_m: W, boulder_length_m: L }) {
    return outlineOf(this.data.boulder.profile, { H, W, L });
  }

  /** @returns {boolean} whether a design takes a hundred times as long as in the closed form of the soil */
  get isSlow() {
    return this.data.controls[0][this.at("elements")] > 0;
  }

  /**
   * Fill in what follows from the other inputs, and say what cannot be.
   * @param {Record<string, number>} inputs
   * @returns {{inputs: Record<string, number>, refusal: string, at: string}} `at`: the input beside which it is said
   */
  completed(inputs) {
    const exposed = inputs.boulder_height_m - inputs.embedment_depth_m;
    const [bumper, hood] = [inputs.bumper_height_m, inputs.hood_height_m];
    const impact = this.data.face ? 0.5 * (Math.min(exposed, hood) + bumper) : inputs.impact_height_m;
    const { flat_foot, least_solidity, least_taped, most_solidity, filled, profile } = this.data.boulder;
    const solidity = solidityOf(inputs, filled);
    const known_shape = Number(profile.length > 0 || solidity >= least_solidity);
    let refused = 0;
    if (!known_shape && solidity >= least_taped) refused = this.data.refusals.length - 1;
    if (solidity > most_solidity) refused = 4;
    if (!this.data.face && impact > exposed * (1 + 1e-12) && exposed > bumper) refused = 3;
    if (hood < bumper) refused = 2;
    if (exposed <= 0) refused = 1;
    const [refusal, at] = this.data.refusals[refused];
    const reach_m = reachOf(this.outline(inputs), inputs.embedment_depth_m + impact);
    const shape = { solidity, flat_foot, known_shape, reach_m };
    const { angle, least, most } = this.data.rules.families;
    const [least_beta, most_beta] = [least, most].map((/** @type {number[]} */ values) =>
      Math.exp(interpolated(angle, values.map(Math.log), inputs.friction_angle_deg)));
    return { inputs: { ...inputs, ...shape, least_beta, most_beta, impact_height_m: impact }, refusal, at };
  }

  /**
   * Simulate and judge designs as `sweep run` does its rows, up to the limit.
   * @param {Record<string, number>[]} designs
   * @returns {Judged[]}
   */
  rows(designs) {
    const complete = designs.map((design) => this.completed(design));
    const inputs = complete.map((one) => one.inputs);
    const { rules, controls } = this.data;
    const results = this.kernel.rows(inputs.map((one) => this.kernelDesign(one)), inputs, controls, rules.limits);
    return complete.map(({ inputs, refusal }, row) => {
      const found = judge(results, row, inputs, rules);
      found.step_s = found.end_time_s === null ? null : exact(results.step[row]);
      if (refusal === "") return found;
      const nothing = Object.fromEntries(Object.keys(found).map((name) => [name, null]));
      return { ...nothing, verdict: "error", reason: refusal, rating: null };
    });
  }

  /**
   * Judge one design as `sweep run` does, and simulate it beyond the limit as `sweep simulate` does.
   * @param {Record<string, number>} design
   * @returns {{judged: Judged, motion: Motion, inputs: Record<string, number>}}
   */
  whole(design) {
    const { inputs, refusal } = this.completed(design);
    const [{ decided_by, ...judged }] = this.rows([design]);
    const [settings, end] = [this.beyond(decided_by ?? 0, judged.step_s), judged.end_time_s ?? 0];
    const drawn = Math.max(this.horizon, judged.time_to_limit_s === null ? end : end + SEEN_AFTER * this.horizon);
    settings[this.at("horizon")] = drawn;
    const last = Math.max(Math.round((SAMPLES * drawn) / this.horizon), 1);
    const at = (/** @type {unknown} */ _, /** @type {number} */ k) => ((drawn * k) / last) * BEFORE_THE_END;
    const times = Float64Array.from({ length: refusal === "" ? last + 1 : 0 }, at);
    return { judged, motion: this.kernel.history(this.kernelDesign(inputs), settings, times), inputs };
  }

  /**
   * The settings by which a row was decided, for a simulation that goes on beyond the limit.
   * @param {number} number of these settings
   * @param {number | null} step_s by which the row was decided: half of theirs where that was doubtful [s]
   * @returns {number[]}
   */
  beyond(number, step_s) {
    const settings = [...this.data.controls[number]];
    const [h, paired] = [this.at("h"), this.at("paired")];
    settings[this.at("stop_at_limit")] = 0;
    if (settings[paired] === 0 && step_s === exact(this.data.steps_s[number] / 2)) {
      settings[h] /= 2;
      settings[this.at("locate_yield")] = 1;
      settings[this.at("event_tolerance")] = this.data.controls.at(-1)[this.at("event_tolerance")];  // of all but the first
    }
    return settings;
  }

  /** @returns {Motion} of what is not simulated */
  motionless() {
    const none = this.data.layout.history.map((/** @type {string} */ name) => [name, new Float64Array(0)]);
    return { time: new Float64Array(0), columns: Object.fromEntries(none), c_x: 0, c_y: 0 };
  }
}

/**
 * What a design must keep to, and the words of every verdict; written by Python.
 * @typedef {object} Rules
 * @property {number} rotation largest rotation [rad]
 * @property {number[]} limits of the criterion, and what the model was tested on, as the kernel takes them
 * @property {[string, string][]} verdicts verdict and reason of every rule of the kernel
 * @property {string} not_finite the reason where a result is not a finite number
 * @property {[string, number][]} ratings every rating and its largest penetration [m], the best first
 * @property {Record<string, number>} status how a simulation can end, by name
 * @property {Record<string, string>} why the reason of each status that leaves a design without a result
 * @property {Record<string, string>} flags meaning of every flag, from the lowest bit on
 * @property {{angle: number[], least: number[], most: number[]}} families subgrade reactions [MN/m^3] that go with
 *   friction angles [deg]
 */

/**
 * The outcome columns of one row, by the names of the table; null for no value.
 * @typedef {{verdict: string, reason: string, rating: string | null} & Record<string, any>} Judged
 */

const DEGREES = 180 / Math.PI;

/**
 * Give the verdict on one design, as the kernel has ruled.
 * @param {Record<string, Float64Array>} results of `Kernel.rows`
 * @param {number} row which design
 * @param {Record<string, number>} inputs the design by the names of the table
 * @param {Rules} rules
 * @returns {Judged}
 */
function judge(results, row, inputs, rules) {
  /** @param {string} name */
  const of = (name) => results[name][row];
  const [penetration, overlap, margin, ended] = ["penetration", "overlap", "margin", "status"].map(of);
  let [verdict, reason] = rules.verdicts[of("rule")];
  if (verdict === "error") reason = rules.why[ended] ?? rules.not_finite;
  const valid = verdict !== "error" && reason !== "no_contact";
  const overturned = reason === "overturns";
  const rated = valid && !overturned && reason !== "slower_truck" && (verdict !== "undecided" || reason === "error");
  const rating = rules.ratings.find(([, most]) => penetration <= most)?.[0] ?? null;
  const flags = Object.keys(rules.flags).filter((_, bit) => (of("flags") >> bit) & 1);
  /** @param {number} value @param {boolean} known */
  const kept = (value, known = valid) => (known && Number.isFinite(value) ? value : null);
  return {
    verdict,
    reason,
    margin: kept(margin, rated),
    max_rotation_deg: kept(of("theta_max") * DEGREES),
    max_displacement_m: kept(of("x_b_max")),
    max_vehicle_displacement_m: kept(of("x_v_max")),
    peak_force_kN: kept(of("F_v_max") / 1000),
    penetration_m: kept(penetration),
    rating: rated ? rating : null,
    time_to_limit_s: kept(of("t_limit"), overturned),
    end_time_s: kept(of("t_end")),
    rotation_error_deg: kept(of("theta_error") * DEGREES, valid && !(overturned && ended === rules.status.LIMIT)),
    displacement_error_m: kept(of("x_error")),
    time_to_limit_error_s: kept(of("x_error") / inputs.impact_speed_m_s, overturned),
    vehicle_crush_m: kept(of("crush_max")),
    overlap_m: verdict === "error" ? null : overlap,
    solidity: verdict === "error" ? null : inputs.solidity,
    validity: verdict === "error" ? null : flags.join(";"),
    decided_by: of("decided_by"),
  };
}
