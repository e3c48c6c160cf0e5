// @ts-check
"use strict";

/**
 * What a design must keep to, and the words of every verdict; written by Python.
 * @typedef {object} Rules
 * @property {number} rotation largest rotation [rad]
 * @property {number[]} limits of the criterion, as the kernel takes them
 * @property {[string, string][]} verdicts verdict and reason of every rule of the kernel
 * @property {string} not_finite the reason where a result is not a finite number
 * @property {[string, number][]} ratings every rating and its largest penetration [m], the best first
 * @property {Record<string, number>} status how a simulation can end, by name
 * @property {Record<string, string>} why the reason of each status that leaves a design without a result
 * @property {Tested} tested
 */

/**
 * What the model was tested on: values beyond which a row is flagged; written by Python.
 * @typedef {object} Tested
 * @property {number} rotation [rad]
 * @property {number} crush [m]
 * @property {number} overlap [m]
 * @property {Record<string, [number, number]>} usual range of sizes, embedment ratio and density of rock
 * @property {{angle: number[], least: number[], most: number[]}} soil subgrade reaction [MN/m^3] over friction angle [deg]
 * @property {Record<string, string>} meanings of every flag, in their order
 */

/**
 * The outcome columns of one row, by the names of the table; null for no value.
 * @typedef {{verdict: string, reason: string, rating: string | null} & Record<string, any>} Judged
 */

const DEGREES = 180 / Math.PI;

/**
 * Give the verdict on one design, as the kernel has ruled.
 * @param {Record<string, Float64Array>} results of the kernel, as of `Kernel.rows`
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
  const rated = valid && !overturned && (verdict !== "undecided" || reason === "error");
  const rating = rules.ratings.find(([, most]) => penetration <= most)?.[0] ?? null;
  /** @param {number} value @param {boolean} known */
  const kept = (value, known = valid) => (known && !Number.isNaN(value) ? value : null);
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
    validity: verdict === "error" ? null : flagsOf(results, row, inputs, overlap, rules).join(";"),
    decided_by: of("decided_by"),
  };
}

/**
 * The flags of one design: those of `boulder_sweep.judge.validity`, held against them by a test.
 * @param {Record<string, Float64Array>} results
 * @param {number} row
 * @param {Record<string, number>} inputs
 * @param {number} overlap [m]
 * @param {Rules} rules
 * @returns {string[]} their names
 */
function flagsOf(results, row, inputs, overlap, rules) {
  const { tested } = rules;
  const depth = inputs.embedment_depth_m;
  /** @param {string} name @param {number} value */
  const outside = (name, value) => value < tested.usual[name][0] || value > tested.usual[name][1];
  /** @param {number[]} values */
  const along = (values) => Math.exp(interpolated(tested.soil.angle, values.map(Math.log), inputs.friction_angle_deg));
  const reaction = inputs.subgrade_reaction_MN_m3;
  /** @type {Record<string, boolean>} */
  const raised = {
    crush: results.crush_max[row] > tested.crush,
    rotation: results.theta_max[row] > tested.rotation,
    size: ["boulder_length_m", "boulder_width_m", "boulder_height_m"].some((name) => outside(name, inputs[name])),
    embedment: outside("embedment_ratio", depth / inputs.boulder_height_m),
    rock_density: outside("boulder_density_kg_m3", inputs.boulder_density_kg_m3),
    soil_pair: reaction > along(tested.soil.most) || reaction < along(tested.soil.least),
    overlap: overlap < tested.overlap,
    unproved: results.status[row] === rules.status.UNPROVABLE,
  };
  return Object.keys(tested.meanings).filter((name) => raised[name]);
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
