// @ts-check
"use strict";

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
