// @ts-check
"use strict";

/**
 * What a design must keep to, and the words of every verdict; written by Python.
 * @typedef {object} Rules
 * @property {number} rotation largest rotation [rad]
 * @property {number} penetration largest penetration of the required rating [m]
 * @property {number} min_overlap least height of the boulder's top over the underside of the bumper [m]
 * @property {[string, number][]} ratings every rating and its largest penetration [m], the best first
 * @property {Record<string, number>} status how a simulation can end, by name
 * @property {number[]} simulated those that have maxima to report
 * @property {Record<string, string>} why the reason of each status that leaves a design without a result
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
  const overturned = valid && (ended === status.LIMIT || theta >= rules.rotation);
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
  else if (ended === status.OUTWARD || ended === status.HORIZON) [verdict, reason] = ["undecided", "horizon"];
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
    rotation_error_deg: kept(of("theta_error") * DEGREES),
    displacement_error_m: kept(of("x_error")),
    vehicle_crush_m: kept(crush),
    overlap_m: verdict === "error" ? null : overlap,
  };
}
