// @ts-check
"use strict";

/**
 * What a design must keep to, and the words of every verdict; written by Python.
 * @typedef {object} Rules
 * @property {number} rotation largest rotation [rad]
 * @property {number} penetration largest penetration of the required rating [m]
 * @property {number} min_overlap least height of the boulder's top over the underside of the bumper [m]
 * @property {number[]} simulated ends of a simulation that has maxima to report
 * @property {[string, number][]} ratings every rating and its largest penetration [m], the best first
 * @property {Record<string, number>} status how a simulation can end, by name
 * @property {Record<string, string>} why the reason of each status that leaves a design without a result
 * @property {string[]} open those of them that finer steps may mend
 * @property {Tested} tested
 */

/**
 * What the model was tested on: values beyond which a row is flagged; written by Python.
 * @typedef {object} Tested
 * @property {number} rotation [rad]
 * @property {number} crush [m]
 * @property {number} width over embedment depth
 * @property {number} overlap [m]
 * @property {number} lift of a blow over weight and side friction
 * @property {number} wall_friction friction angle between boulder and soil over that of the soil
 * @property {number} gravity [m/s^2]
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
 * Give the verdict on one design: the rules of `boulder_sweep.judge.verdict` for a row, held against them by a test.
 * @param {Record<string, Float64Array>} outcomes what the kernel computed
 * @param {number} row which design
 * @param {Record<string, number>} inputs the design by the names of the table
 * @param {Rules} rules
 * @returns {Judged}
 */
function judge(outcomes, row, inputs, rules) {
  /** @param {string} name */
  const of = (name) => outcomes[name][row];
  const { status } = rules;
  const ended = of("status");
  const [theta, x_b, x_v, F_v, crush, end] = ["theta_max", "x_b_max", "x_v_max", "F_v_max", "crush_max", "t_end"].map(of);
  const valid = rules.simulated.includes(ended) && [theta, x_b, x_v, F_v, crush, end].every(Number.isFinite);
  // Where only one of two solutions overturns the error is infinite, and nothing is decided.
  const overturned = valid && (ended === status.LIMIT || theta >= rules.rotation) && of("theta_error") !== Infinity;
  const standing = valid && !overturned;
  const penetration = x_v - inputs.bed_offset_m - inputs.boulder_length_m;
  const overlap = inputs.boulder_height_m - inputs.embedment_depth_m - inputs.bumper_height_m;
  const room = Math.min(rules.penetration - penetration, inputs.bed_offset_m - crush);

  let [verdict, reason] = ["pass", ""];
  if (ended === status.NO_CONTACT) [verdict, reason] = ["fail", "no_contact"];
  else if (!valid) [verdict, reason] = ["error", rules.why[ended] ?? "the computed result is not a finite number"];
  else if (overturned) [verdict, reason] = ["fail", "overturns"];
  else if (penetration > rules.penetration) [verdict, reason] = ["fail", "penetration"];
  else if (crush > inputs.bed_offset_m) [verdict, reason] = ["undecided", "crush"];
  else if (overlap < rules.min_overlap) [verdict, reason] = ["undecided", "override"];
  else if ([status.OUTWARD, status.HORIZON, status.UNPROVABLE].includes(ended)) [verdict, reason] = ["undecided", "horizon"];
  else if (rules.rotation - theta < of("theta_error") || room < of("x_error")) [verdict, reason] = ["undecided", "error"];
  const rated = standing && (verdict !== "undecided" || reason === "error");

  const margin = Math.min((rules.rotation - theta) / rules.rotation, (rules.penetration - penetration) / rules.penetration);
  const rating = rules.ratings.find(([, most]) => penetration <= most)?.[0] ?? null;
  /** @param {number} value @param {boolean} known */
  const kept = (value, known = valid) => (known && !Number.isNaN(value) ? value : null);
  return {
    verdict,
    reason,
    margin: kept(margin, rated),
    max_rotation_deg: kept(theta * DEGREES),
    max_displacement_m: kept(x_b),
    max_vehicle_displacement_m: kept(x_v),
    peak_force_kN: kept(F_v / 1000),
    penetration_m: kept(penetration),
    rating: rated ? rating : null,
    time_to_limit_s: kept(of("t_limit"), overturned),
    end_time_s: kept(end),
    rotation_error_deg: kept(of("theta_error") * DEGREES, valid && !(overturned && ended === status.LIMIT)),
    displacement_error_m: kept(of("x_error")),
    time_to_limit_error_s: kept(of("x_error") / inputs.impact_speed_m_s, overturned),
    vehicle_crush_m: kept(crush),
    overlap_m: verdict === "error" ? null : overlap,
    validity: verdict === "error" ? null : flagsOf(outcomes, row, inputs, overlap, rules).join(";"),
  };
}

/**
 * The flags of one design: those of `boulder_sweep.judge.validity`, held against them by a test.
 * @param {Record<string, Float64Array>} outcomes
 * @param {number} row
 * @param {Record<string, number>} inputs
 * @param {number} overlap [m]
 * @param {Rules} rules
 * @returns {string[]} their names
 */
function flagsOf(outcomes, row, inputs, overlap, rules) {
  const { tested } = rules;
  const depth = inputs.embedment_depth_m;
  /** @param {string} name @param {number} value */
  const outside = (name, value) => value < tested.usual[name][0] || value > tested.usual[name][1];
  /** @param {number[]} values */
  const along = (values) => Math.exp(interpolated(tested.soil.angle, values.map(Math.log), inputs.friction_angle_deg));
  const reaction = inputs.subgrade_reaction_MN_m3;
  /** @type {Record<string, boolean>} */
  const raised = {
    crush: outcomes.x_v_max[row] - outcomes.x_b_max[row] > tested.crush,
    rotation: outcomes.theta_max[row] > tested.rotation,
    width: tested.width * depth < inputs.boulder_width_m,
    size: ["boulder_length_m", "boulder_width_m", "boulder_height_m"].some((name) => outside(name, inputs[name])),
    embedment: outside("embedment_ratio", depth / inputs.boulder_height_m),
    rock_density: outside("boulder_density_kg_m3", inputs.boulder_density_kg_m3),
    soil_pair: reaction > along(tested.soil.most) || reaction < along(tested.soil.least),
    overlap: overlap < tested.overlap,
    uplift: blowLift(outcomes.F_v_max[row], inputs, tested) > tested.lift,
    unproved: outcomes.status[row] === rules.status.UNPROVABLE,
  };
  return Object.keys(tested.meanings).filter((name) => raised[name]);
}

/**
 * How strongly a blow lifts a boulder: `boulder_sweep.judge.uplift.blow_lift`.
 * @param {number} force its peak [N]
 * @param {Record<string, number>} inputs
 * @param {Tested} tested
 */
function blowLift(force, inputs, tested) {
  const [L, W, H] = [inputs.boulder_length_m, inputs.boulder_width_m, inputs.boulder_height_m];
  const [d, phi] = [inputs.embedment_depth_m, inputs.friction_angle_deg / DEGREES];
  const g = tested.gravity;
  const weight = inputs.boulder_density_kg_m3 * L * W * H * g;
  const friction = (1 - Math.sin(phi)) * Math.tan(tested.wall_friction * phi) * inputs.soil_density_kg_m3 * g * d ** 2 * L;
  return (force * (inputs.impact_height_m + d) * 1.5 * L) / ((L ** 2 + H ** 2) * (weight + friction));
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
